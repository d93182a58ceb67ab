// A ball of radius 0.1 m that stands on z = 0, fine where it does.
// tools/meshes makes ball.msh of it.
SetFactory("OpenCASCADE");
radius = 0.1;

Sphere(1) = {0, 0, radius, radius};
Physical Volume("ball") = {1};

Field[1] = MathEval;
Field[1].F = "0.0025 + 0.3 * Max(0, sqrt(x*x + y*y + z*z) - 0.006)";
Background Field = 1;
Mesh.MeshSizeMax = 0.018;
Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.MeshSizeFromPoints = 0;
Mesh.MeshSizeFromCurvature = 0;
