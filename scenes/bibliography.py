"""The works that techniques and media are built on, by the keys under which they are cited."""

BIBLIOGRAPHY = {
    "chandrasekhar-1960": "Chandrasekhar (1960). Radiative Transfer. Dover. Chapter 2, on discrete ordinates.",
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
    "kingslake-2010": "Kingslake, Johnson (2010). Lens Design Fundamentals, second edition. Coddington's equations.",
    "nvidia-2005": (
        "NVIDIA (2005). The GeForce 7800 GTX demos: Luna and Mad Mod Mike. Conference talk, parts on indirect diffuse "
        "lighting and soft omnidirectional shadows."
    ),
    "opengl-4.6": "Segal, Akeley (2022). The OpenGL Graphics System: A Specification, version 4.6 (core profile).",
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
