// A quarter of each of two balls of radius 0.1 m that touch in the origin:
// x >= 0, y >= 0, one above z = 0, one below. Edges grow from a third of the
// radius of Hertz's circle of contact, 4.2 mm; those of the lower ball are a
// fifth longer, so that nodes do not match.
// tools/meshes makes balls.msh of it.
SetFactory("OpenCASCADE");
radius = 0.1;

Sphere(1) = {0, 0, radius, radius, -Pi/2, Pi/2, Pi/2};
Sphere(2) = {0, 0, -radius, radius, -Pi/2, Pi/2, Pi/2};

Physical Volume("upper") = {1};
Physical Volume("lower") = {2};
Physical Surface("symmetry_y") = {2, 5};
Physical Surface("symmetry_x") = {3, 6};

Field[1] = MathEval;
Field[1].F = "(1.1 - 0.1 * z / (abs(z) + 1e-9)) * 0.0014 + 0.4 * Max(0, sqrt(x*x + y*y + z*z) - 0.0053)";
Background Field = 1;
Mesh.MeshSizeMax = 0.03;
Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.MeshSizeFromPoints = 0;
Mesh.MeshSizeFromCurvature = 0;
