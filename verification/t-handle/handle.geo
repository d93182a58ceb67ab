// A T-handle of seven cubes of 0.1 m: a crossbar of five along y, a stem of two along x.
// tools/meshes makes handle.msh of it.
h = 0.1;
Point(1) = {0, 0, 0};
Point(2) = {0, 2 * h, 0};
Point(3) = {0, 3 * h, 0};
Point(4) = {0, 5 * h, 0};
Point(5) = {h, 0, 0};
Point(6) = {h, 2 * h, 0};
Point(7) = {h, 3 * h, 0};
Point(8) = {h, 5 * h, 0};
Point(9) = {3 * h, 2 * h, 0};
Point(10) = {3 * h, 3 * h, 0};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {5, 6};
Line(5) = {6, 7};
Line(6) = {7, 8};
Line(7) = {1, 5};
Line(8) = {2, 6};
Line(9) = {3, 7};
Line(10) = {4, 8};
Line(11) = {6, 9};
Line(12) = {7, 10};
Line(13) = {9, 10};
Curve Loop(1) = {7, 4, -8, -1};
Plane Surface(1) = {1};
Curve Loop(2) = {8, 5, -9, -2};
Plane Surface(2) = {2};
Curve Loop(3) = {9, 6, -10, -3};
Plane Surface(3) = {3};
Curve Loop(4) = {11, 13, -12, -5};
Plane Surface(4) = {4};
Transfinite Curve {1, 3, 4, 6, 11, 12} = 3;
Transfinite Curve {2, 5, 7, 8, 9, 10, 13} = 2;
Transfinite Surface {1, 2, 3, 4};
Recombine Surface {1, 2, 3, 4};
Extrude {0, 0, h} {
  Surface{1, 2, 3, 4};
  Layers{1};
  Recombine;
}
