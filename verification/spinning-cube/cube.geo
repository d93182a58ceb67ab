// A cube of 1 m, meshed freely: tetrahedra with four nodes along each edge.
// tools/meshes makes cube.msh of it.
SetFactory("OpenCASCADE");
Box(1) = {0, 0, 0, 1, 1, 1};
Mesh.MeshSizeMin = 0.4;
Mesh.MeshSizeMax = 0.4;
