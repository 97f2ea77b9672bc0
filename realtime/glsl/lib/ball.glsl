// Part of a ball's disk that is above the horizon of a receiver; `height` is that of the ball's centre over the receiver's
// plane. The area of a segment of the disk: exact for a ball that is far away.
float part_above_horizon(float height, float radius) {
    if (abs(height) >= radius) return height > 0.0 ? 1.0 : 0.0;
    float x = height / radius;
    return 0.5 + (x * sqrt(1.0 - x * x) + asin(x)) / 3.14159265358979;
}
