"""The works that techniques and metrics are built on, by the keys under which they are cited."""

BIBLIOGRAPHY = {
    "nvidia-2005": (
        "NVIDIA (2005). The GeForce 7800 GTX demos: Luna and Mad Mod Mike. Conference talk, parts on indirect diffuse "
        "lighting and soft omnidirectional shadows."
    ),
    "opengl-4.6": "Segal, Akeley (2022). The OpenGL Graphics System: A Specification, version 4.6 (core profile).",
    "ramamoorthi-2001": (
        "Ramamoorthi, Hanrahan (2001). An Efficient Representation for Irradiance Environment Maps. "
        "Proc. SIGGRAPH, 497-500."
    ),
    "wallace-1989": (
        "Wallace, Elmquist, Haines (1989). A Ray Tracing Algorithm for Progressive Radiosity. Proc. SIGGRAPH, 315-324."
    ),
}
