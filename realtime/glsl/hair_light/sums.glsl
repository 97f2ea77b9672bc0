// What is in each cell, as sums of whole numbers: they come out the same in whatever order they are added. Parts of `one` hold
// area; there is room for all hair in one cell.
const int SUMS = 16;
const int AREA = 0;             // of hair: diameter times length
const int TANGENT = 1;          // times area, 3
const int MOMENT = 4;           // tangent times tangent times area: xx, yy, zz, xy, xz, yz
const int SKIN_NORMAL = 10;     // times the skin's area, 3
const int SKIN_REFLECTED = 13;  // reflectance times area, 3
layout(std430, binding = 0) buffer Sums { int sums[]; };
