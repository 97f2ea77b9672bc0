// All hairs of a scene.
layout(std430, binding = 6) buffer StrandPoints { vec4 strand_points[]; };  // four control points each; w: radius
layout(std430, binding = 7) buffer StrandColors { vec4 strand_colors[]; };  // w: which hair of the scene
