// Point i of `count` spread evenly over the unit disk, turned by `turn`. Vogel 1979, "A better way to construct the sunflower
// head".
vec2 vogel_point(int i, int count, float turn) {
    float angle = float(i) * 2.39996322972865 + turn;
    return sqrt((float(i) + 0.5) / float(count)) * vec2(cos(angle), sin(angle));
}
