#version 430
// Steps of a bitonic sort of pairs by the first number, then by the second. Batcher 1968, "Sorting networks and their applications".
layout(std430, binding = 4) buffer Order { uvec2 order[]; };

bool is_after(uvec2 a, uvec2 b) {
    return a.x > b.x || (a.x == b.x && a.y > b.y);
}

// The lower one of the `pair`-th two that are `stride` apart; a stride is a power of two.
uint lower(uint pair, uint stride) {
    return 2u * pair - (pair & (stride - 1u));
}

#ifdef INVOCATIONS
// All steps within blocks of twice as many as INVOCATIONS, for runs of `first_run` up to `last_run`.
layout(local_size_x = INVOCATIONS) in;
shared uvec2 part[2 * INVOCATIONS];
uniform uint first_run;
uniform uint last_run;
void main() {
    uint t = gl_LocalInvocationID.x, base = gl_WorkGroupID.x * 2u * uint(INVOCATIONS);
    part[t] = order[base + t];
    part[t + INVOCATIONS] = order[base + t + INVOCATIONS];
    for (uint run = first_run; run <= last_run; run *= 2u)
        for (uint stride = min(run / 2u, uint(INVOCATIONS)); stride > 0u; stride /= 2u) {
            memoryBarrierShared();
            barrier();
            uint i = lower(t, stride);
            uvec2 a = part[i], b = part[i + stride];
            if (is_after(a, b) == (((base + i) & run) == 0u)) {
                part[i] = b;
                part[i + stride] = a;
            }
        }
    memoryBarrierShared();
    barrier();
    order[base + t] = part[t];
    order[base + t + INVOCATIONS] = part[t + INVOCATIONS];
}
#else
// One step between blocks.
layout(local_size_x = 64) in;
uniform uint run;
uniform uint stride;
uniform uint pairs;
void main() {
    if (gl_GlobalInvocationID.x >= pairs) return;
    uint i = lower(gl_GlobalInvocationID.x, stride);
    uvec2 a = order[i], b = order[i + stride];
    if (is_after(a, b) == ((i & run) == 0u)) {
        order[i] = b;
        order[i + stride] = a;
    }
}
#endif
