#version 430
// Distance from a point of the light. What lies in the ball is not drawn: a way to the light ends where it meets the ball.
uniform vec3 eye;
uniform vec3 ball_centre;
uniform float ball_radius;
in vec3 position;
layout(location = 0) out float out_distance;
void main() {
    if (distance(position, ball_centre) < ball_radius) discard;
    out_distance = distance(position, eye);
}
