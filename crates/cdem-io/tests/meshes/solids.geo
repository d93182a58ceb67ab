// Three solids apart from each other: tetrahedra, wedges, hexahedra.
Mesh.MeshSizeMax = 1.5;
Mesh.MeshSizeMin = 1.5;
SetFactory("OpenCASCADE");
Box(1) = {0, 0, 0, 1, 1, 1};
Rectangle(100) = {2, 0, 0, 1, 1};
Rectangle(200) = {4, 0, 0, 1, 1};
Transfinite Surface {200};
Recombine Surface {200};
wedges[] = Extrude {0, 0, 1} { Surface{100}; Layers{1}; Recombine; };
hexes[] = Extrude {0, 0, 1} { Surface{200}; Layers{2}; Recombine; };
Physical Volume("tets") = {1};
Physical Volume("wedges") = {wedges[1]};
Physical Volume("hexes") = {hexes[1]};
Physical Surface("top") = {wedges[0], hexes[0]};
