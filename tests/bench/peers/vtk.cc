// VTK's vtkUnstructuredGrid: cells, points, and links from points to cells; neither edges nor faces.

#include <vtkCell.h>
#include <vtkCellArray.h>
#include <vtkCellType.h>
#include <vtkIdList.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkSmartPointer.h>
#include <vtkUnstructuredGrid.h>

#include <algorithm>
#include <vector>

#include "tests/bench/peers/peer.h"
#include "tests/bench/tasks.h"

namespace dynmesh::bench {
namespace {

using Grid = vtkSmartPointer<vtkUnstructuredGrid>;

int VtkTypeOf(ElementType type) {
  return type == ElementType::kTetrahedron  ? VTK_TETRA
         : type == ElementType::kHexahedron ? VTK_HEXAHEDRON
                                            : VTK_TRIANGLE;
}

Grid Build(const MeshInput& input) {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  points->SetNumberOfPoints(input.points.size());
  for (size_t i = 0; i < input.points.size(); ++i) points->SetPoint(i, input.points[i].data());
  vtkNew<vtkCellArray> cells;
  cells->AllocateExact(input.num_elements(), input.elements.size());
  std::vector<vtkIdType> row(input.stride());
  for (size_t i = 0; i < input.elements.size(); i += input.stride()) {
    for (size_t k = 0; k < row.size(); ++k) row[k] = input.elements[i + k].slot();
    cells->InsertNextCell(row.size(), row.data());
  }
  auto grid = Grid::New();
  grid->SetPoints(points);
  grid->SetCells(VtkTypeOf(input.type), cells);
  grid->BuildLinks();
  return grid;
}

uint64_t SumCellEdgeEnds(vtkUnstructuredGrid* grid) {
  uint64_t sum = 0;
  for (vtkIdType c = 0; c < grid->GetNumberOfCells(); ++c) {
    vtkCell* cell = grid->GetCell(c);
    for (int e = 0; e < cell->GetNumberOfEdges(); ++e) {
      vtkIdList* ends = cell->GetEdge(e)->GetPointIds();
      sum += ends->GetId(0) + ends->GetId(1);
    }
  }
  return sum;
}

uint64_t SumVertexCells(vtkUnstructuredGrid* grid) {
  uint64_t sum = 0;
  for (vtkIdType v = 0; v < grid->GetNumberOfPoints(); ++v) {
    vtkIdType count, *cells;
    grid->GetPointCells(v, count, cells);
    for (vtkIdType i = 0; i < count; ++i) sum += cells[i];
  }
  return sum;
}

/// Through the faces of the template, which spares VTK its own cell objects.
uint64_t SumCellCells(vtkUnstructuredGrid* grid, const ElementTemplate& shape) {
  vtkNew<vtkIdList> corners, neighbors, face;
  uint64_t sum = 0;
  for (vtkIdType c = 0; c < grid->GetNumberOfCells(); ++c) {
    grid->GetCellPoints(c, corners);
    for (int i = 0; i < shape.num_faces; ++i) {
      face->Reset();
      for (int k = 0; k < shape.faces[i].size; ++k)
        face->InsertNextId(corners->GetId(shape.faces[i].vertices[k]));
      grid->GetCellNeighbors(c, face, neighbors);
      for (vtkIdType n = 0; n < neighbors->GetNumberOfIds(); ++n) sum += neighbors->GetId(n);
    }
  }
  return sum;
}

/// Of simplices: two vertices of a cell are always joined by an edge.
uint64_t SumVertexVertices(vtkUnstructuredGrid* grid) {
  std::vector<vtkIdType> row;
  uint64_t sum = 0;
  for (vtkIdType v = 0; v < grid->GetNumberOfPoints(); ++v) {
    row.clear();
    vtkIdType count, *cells;
    grid->GetPointCells(v, count, cells);
    for (vtkIdType i = 0; i < count; ++i) {
      vtkIdType size;
      const vtkIdType* corners;
      grid->GetCellPoints(cells[i], size, corners);
      std::copy_if(corners, corners + size, std::back_inserter(row), [v](vtkIdType w) { return w != v; });
    }
    std::sort(row.begin(), row.end());
    row.erase(std::unique(row.begin(), row.end()), row.end());
    for (vtkIdType w : row) sum += w;
  }
  return sum;
}

}  // namespace

void RegisterVtk(const Fixture& fixture) {
  const MeshInput& input = fixture.input;
  const FlatMesh& flat = fixture.flat;
  const Grid peer = Build(input);
  const Relation vertex_elements = flat.has_cells() ? kVertexCells : kVertexFaces;
  RegisterPeerBuild("vtk/build", input.num_elements(), [&] { return Build(input); });
  RegisterPeerTask("vtk/relation/" + NameOf(vertex_elements), SumOf(flat, vertex_elements),
                   [peer] { return SumVertexCells(peer); });
  if (input.type != ElementType::kHexahedron) {
    RegisterPeerTask("vtk/relation/v_v", SumOf(flat, kVertexVertices),
                     [peer] { return SumVertexVertices(peer); });
  }
  if (!flat.has_cells()) return;
  RegisterPeerTask("vtk/paper_task", SumOfCellEdgeEnds(flat), [peer] { return SumCellEdgeEnds(peer); });
  const ElementTemplate& shape = TemplateOf(input.type);
  RegisterPeerTask("vtk/relation/c_c", SumOf(flat, kCellCells),
                   [peer, &shape] { return SumCellCells(peer, shape); });
}

}  // namespace dynmesh::bench
