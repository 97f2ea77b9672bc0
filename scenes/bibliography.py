"""The works that techniques and media are built on, by the keys under which they are cited."""

BIBLIOGRAPHY = {
    "chandrasekhar-1960": "Chandrasekhar (1960). Radiative Transfer. Dover. Chapter 2, on discrete ordinates.",
    "chiang-2016": (
        "Chiang, Bitterli, Tappan, Burley (2016). A Practical and Controllable Hair and Fur Model for Production Path "
        "Tracing. Computer Graphics Forum 35(2), 275-283."
    ),
    "drobot-2009": (
        "Drobot (2009). Quadtree Displacement Mapping with Height Blending. GPU Pro, A K Peters, section II.1, 117-148."
    ),
    "fernando-2005": "Fernando (2005). Percentage-Closer Soft Shadows. SIGGRAPH 2005 Sketches, 35.",
    "goral-1984": (
        "Goral, Torrance, Greenberg, Battaile (1984). Modeling the Interaction of Light between Diffuse Surfaces. "
        "Proc. SIGGRAPH, 213-222."
    ),
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
    "kajiya-1989": "Kajiya, Kay (1989). Rendering Fur with Three Dimensional Textures. Proc. SIGGRAPH, 271-280.",
    "kaneko-2001": (
        "Kaneko, Takahei, Inami, Kawakami, Yanagida, Maeda, Tachi (2001). Detailed Shape Representation with Parallax "
        "Mapping. Proc. ICAT, 205-208."
    ),
    "king-2004": (
        "King, Newhall (2004). Efficient Omnidirectional Shadow Maps. ShaderX3, Charles River Media, 435-448."
    ),
    "kingslake-2010": "Kingslake, Johnson (2010). Lens Design Fundamentals, second edition. Coddington's equations.",
    "lengyel-2001": (
        "Lengyel (2001). Computing Tangent Space Basis Vectors for an Arbitrary Mesh. Terathon Software 3D Graphics "
        "Library."
    ),
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
    "tevs-2008": (
        "Tevs, Ihrke, Seidel (2008). Maximum Mipmaps for Fast, Accurate, and Scalable Dynamic Height Field Rendering. "
        "Proc. I3D, 183-190."
    ),
    "wallace-1989": (
        "Wallace, Elmquist, Haines (1989). A Ray Tracing Algorithm for Progressive Radiosity. Proc. SIGGRAPH, 315-324."
    ),
    "walter-2007": (
        "Walter, Marschner, Li, Torrance (2007). Microfacet Models for Refraction through Rough Surfaces. "
        "Proc. Eurographics Symposium on Rendering, 195-206."
    ),
    "yuksel-2010": (
        "Yuksel, Tariq (2010). Advanced Techniques in Real-time Hair Rendering and Simulation. ACM SIGGRAPH Courses."
    ),
}
