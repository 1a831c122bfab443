// A plate with a round hole right through it, for the demo (drag_hole.py), which tells gmsh where the hole is:
//
//   gmsh -3 plate_with_hole.geo -setnumber hole_x 3 -setnumber radius 0.8 -o plate_with_hole.msh
//
// About 72,000 tetrahedra: fine where the hole is going to pass, coarse elsewhere.
SetFactory("OpenCASCADE");

DefineConstant[
  length = 12,
  width = 6,
  thickness = 0.6,
  hole_x = 3,
  hole_y = 3,
  radius = 0.8,
  fine = 0.12,   // characteristic length along the path of the hole,
  coarse = 0.25, // and far from it
  reach = 1.9,   // half the width of the fine strip
  travel = 5     // how far it runs to the right of the hole
];

Box(1) = {0, 0, 0, length, width, thickness};
Cylinder(2) = {hole_x, hole_y, 0, 0, 0, thickness, radius};
BooleanDifference(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };
Physical Volume("plate") = {3};

Field[1] = Box;
Field[1].VIn = fine;
Field[1].VOut = coarse;
Field[1].XMin = hole_x - reach;
Field[1].XMax = hole_x + travel + reach;
Field[1].YMin = hole_y - reach;
Field[1].YMax = hole_y + reach;
Field[1].ZMin = -1;
Field[1].ZMax = thickness + 1;
Field[1].Thickness = 1;
Background Field = 1;

Mesh.CharacteristicLengthFromPoints = 0;
Mesh.CharacteristicLengthExtendFromBoundary = 0;
Mesh.Optimize = 1;
