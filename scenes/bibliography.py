"""The works that techniques and media are built on, by the keys under which they are cited."""

BIBLIOGRAPHY = {
    "chandrasekhar-1960": "Chandrasekhar (1960). Radiative Transfer. Dover. Chapter 2, on discrete ordinates.",
    "fernando-2005": "Fernando (2005). Percentage-Closer Soft Shadows. SIGGRAPH 2005 Sketches, 35.",
    "greger-1998": (
        "Greger, Shirley, Hubbard, Greenberg (1998). The Irradiance Volume. IEEE Computer Graphics and Applications "
        "18(2), 32-43."
    ),
    "haeberli-1990": (
        "Haeberli, Akeley (1990). The Accumulation Buffer: Hardware Support for High-Quality Rendering. "
        "Proc. SIGGRAPH, 309-318."
    ),
    "haines-2019": (
        "Haines, Günther, Akenine-Möller (2019). Precision Improvements for Ray/Sphere Intersection. "
        "Ray Tracing Gems, chapter 7, 87-94."
    ),
    "jacques-2013": (
        "Jacques (2013). Optical properties of biological tissues: a review. Physics in Medicine and Biology 58(11), "
        "R37-R61."
    ),
    "jensen-2001": (
        "Jensen, Marschner, Levoy, Hanrahan (2001). A Practical Model for Subsurface Light Transport. "
        "Proc. SIGGRAPH, 511-518."
    ),
    "king-2004": (
        "King, Newhall (2004). Efficient Omnidirectional Shadow Maps. ShaderX3, Charles River Media, 435-448."
    ),
    "kingslake-2010": "Kingslake, Johnson (2010). Lens Design Fundamentals, second edition. Coddington's equations.",
    "nvidia-2005": (
        "NVIDIA (2005). The GeForce 7800 GTX demos: Luna and Mad Mod Mike. Conference talk, parts on indirect diffuse "
        "lighting and soft omnidirectional shadows."
    ),
    "opengl-4.6": "Segal, Akeley (2022). The OpenGL Graphics System: A Specification, version 4.6 (core profile).",
    "potmesil-1982": (
        "Potmesil, Chakravarty (1982). Synthetic Image Generation with a Lens and Aperture Camera Model. "
        "ACM Transactions on Graphics 1(2), 85-108."
    ),
    "prahl-1995": (
        "Prahl (1995). The Adding-Doubling Method. Optical-Thermal Response of Laser-Irradiated Tissue, chapter 5, "
        "101-129."
    ),
    "ramamoorthi-2001": (
        "Ramamoorthi, Hanrahan (2001). An Efficient Representation for Irradiance Environment Maps. "
        "Proc. SIGGRAPH, 497-500."
    ),
    "wallace-1989": (
        "Wallace, Elmquist, Haines (1989). A Ray Tracing Algorithm for Progressive Radiosity. Proc. SIGGRAPH, 315-324."
    ),
}
