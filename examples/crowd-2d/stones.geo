// Two swarms of fifteen polygons each, of three to six corners, of all sizes and turns,
// 2.1 m apart; each of as few triangles as there can be.
// gmsh stones.geo -2 -format msh41 -o stones.msh
columns = 6;
rows = 5;
distance = 2.1;

// Numbers that look random, and are the same everywhere.
Macro Random
  seed = (seed * 1103 + 331) % 4099;
  random = seed / 4099;
Return
seed = 20;

For c In {0:columns - 1}
  For r In {0:rows - 1}
    Call Random;
    corners = 3 + Floor(4 * random);
    Call Random;
    radius = 0.75 + 0.3 * random;
    Call Random;
    turn = 2 * Pi * random;
    first = newp;
    For k In {0:corners - 1}
      Call Random;
      angle = turn + 2 * Pi * (k + 0.5 * (random - 0.5)) / corners;
      Point(first + k) = {distance * c + radius * Cos(angle), distance * r + radius * Sin(angle), 0};
    EndFor
    line = newc;
    For k In {0:corners - 1}
      Line(line + k) = {first + k, first + (k + 1) % corners};
    EndFor
    loop = newcl;
    Curve Loop(loop) = {line:line + corners - 1};
    Plane Surface(rows * c + r + 1) = {loop};
    Transfinite Curve {line:line + corners - 1} = 2;
  EndFor
EndFor

// No nodes but the corners.
Mesh.Algorithm = 3;
Mesh.MeshSizeExtendFromBoundary = 0;

half = columns * rows / 2;
Physical Surface("left") = {1:half};
Physical Surface("right") = {half + 1:2 * half};
