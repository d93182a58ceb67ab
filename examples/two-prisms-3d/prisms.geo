// Two prisms over equilateral triangles, side 8 m, 1 m thick, with a gap of 1 m
// between an edge of one and the side of the other; one wedge each.
// gmsh prisms.geo -3 -format msh41 -o prisms.msh
side = 8;
height = side * Sqrt(3) / 2;
thickness = 1;
gap = 1;

Point(1) = {0, 0, 0};
Point(2) = {-height, side / 2, 0};
Point(3) = {-height, -side / 2, 0};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 1};
Curve Loop(1) = {1, 2, 3};
Plane Surface(1) = {1};

Point(4) = {gap, -side / 2, 0};
Point(5) = {gap + height, 0, 0};
Point(6) = {gap, side / 2, 0};
Line(4) = {4, 5};
Line(5) = {5, 6};
Line(6) = {6, 4};
Curve Loop(2) = {4, 5, 6};
Plane Surface(2) = {2};

// One element on each edge, so one triangle in each surface, and one wedge over it.
Transfinite Curve {1:6} = 2;
i[] = Extrude {0, 0, thickness} { Surface{1}; Layers{1}; Recombine; };
j[] = Extrude {0, 0, thickness} { Surface{2}; Layers{1}; Recombine; };

Physical Volume("block_i") = {i[1]};
Physical Volume("block_j") = {j[1]};
