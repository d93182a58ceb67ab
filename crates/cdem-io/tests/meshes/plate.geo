// A plate of two halves, quadrilaterals on the left and triangles on the right.
// gmsh plate.geo -2 -format msh41 -o plate-41-text.msh   (and the like: see README.md)
Point(1) = {0, 0, 0};
Point(2) = {1, 0, 0};
Point(3) = {2, 0, 0};
Point(4) = {0, 1, 0};
Point(5) = {1, 1, 0};
Point(6) = {2, 1, 0};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {4, 5};
Line(4) = {5, 6};
Line(5) = {1, 4};
Line(6) = {2, 5};
Line(7) = {3, 6};
Curve Loop(1) = {1, 6, -3, -5};
Curve Loop(2) = {2, 7, -4, -6};
Plane Surface(1) = {1};
Plane Surface(2) = {2};
Transfinite Curve {1:7} = 3;
Transfinite Surface {1:2};
Recombine Surface {1};
Physical Point("corner") = {1};
Physical Curve("base", 11) = {1, 2};
Physical Curve(7) = {3, 4};
Physical Surface("left", 21) = {1};
Physical Surface("right half", 22) = {2};
Physical Surface("plate", 23) = {1, 2};
