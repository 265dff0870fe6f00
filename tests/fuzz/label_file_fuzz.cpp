// SPDX-License-Identifier: Apache-2.0
// Label maps and markups: the first byte chooses the format, the rest is the file. What is accepted has as
// many voxels as its sizes say, and finite places.

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include "tests/fuzz/seeds.h"
#include "tests/unit/tools/solids/made_up_solids.h"
#include "tools/lib/solids/files/label_reader.h"
#include "tools/lib/solids/files/markups_reader.h"

namespace {

using namespace hapticd;

void requireComplete(const base::Error& error) {
  require(!error.where.empty() && !error.what.empty() && !error.remedy.empty());
}

void takeLabels(std::string_view bytes, const char* name) {
  solids::LabelOptions options;
  options.limits.voxel_bytes = 1 << 20;  // so that variants of sizes are quick
  const auto file = solids::labelFrom(bytes, name, options);
  if (!file) return requireComplete(file.error());
  const auto& size = file->map.size;
  require(size[0] > 2 && size[1] > 2 && size[2] > 2);
  require(file->map.inside.size() == static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) *
                                         static_cast<std::size_t>(size[2]));
  std::size_t inside = 0;
  for (const std::uint8_t voxel : file->map.inside) inside += voxel;
  require(inside == file->report.voxels && inside > 0);
  require(rt::isFinite(file->map.centreOf(size[0], size[1], size[2])));
}

void takeMarkups(std::string_view bytes, const char* name) {
  const auto file = solids::markupsFrom(bytes, name);
  if (!file) return requireComplete(file.error());
  for (const solids::Markup& markup : file->markups) {
    for (const solids::MarkupPoint& point : markup.points)
      require(rt::isFinite(point.position_m) && !point.label.empty());
    require(markup.box.has_value() == (markup.kind == solids::MarkupKind::roi));
    require(markup.plane.has_value() == (markup.kind == solids::MarkupKind::plane));
  }
}

}  // namespace

std::vector<std::string> seeds() {
  const std::vector<std::string> lines{"type: unsigned char",
                                       "dimension: 3",
                                       "sizes: 4 3 2",
                                       "space: LPS",
                                       "space directions: (1,0,0) (0,1,0) (0,0,1)",
                                       "space origin: (0,0,0)"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), lines.begin(), lines.end());
    return std::string(1, '\0') + test::nrrdHeader(more);
  };
  std::string voxels(24, '\0');
  voxels[9] = 1;
  test::MadeUpNifti nifti;
  nifti.dim = {3, 4, 3, 2, 1, 1, 1, 1};
  nifti.sform_code = 1;
  nifti.srow = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  nifti.voxels = voxels;
  test::MadeUpNifti turned = nifti;
  turned.sform_code = 0;
  turned.qform_code = 1;
  turned.quatern = {0.5F, 0.5F, 0.5F};
  return {
      with({"encoding: raw"}) + voxels,
      with({"encoding: gzip", "byte skip: 2"}) + test::gzipped("xx" + voxels),
      with({"encoding: raw", "byte skip: -1", "line skip: 1"}) + "a\n" + voxels,
      with({"type: short", "endian: big", "encoding: raw"}) + voxels + voxels,
      with({"type: float", "endian: little", "encoding: raw"}) + voxels + voxels + voxels + voxels,
      with({"dimension: 4", "sizes: 2 4 3 1", "kinds: list domain domain domain",
            "space directions: none (1,0,0) (0,1,0) (0,0,1)", "encoding: raw", "Segment0_ID:=A",
            "Segment0_Name:=a b", "Segment0_LabelValue:=1", "Segment0_Layer:=1"}) +
          voxels,
      "\1" + nifti.file(),
      "\1" + turned.file(std::endian::big),
      "\2" + test::gzipped(nifti.file()),
      "\3{\"@schema\": \"markups-schema-v1.0.3.json#\", \"markups\": [{\"type\": \"Curve\", "
      "\"coordinateSystem\": \"RAS\", "
      "\"controlPoints\": [{\"label\": \"a\", \"position\": [1, 2.5, -3e1], \"positionStatus\": "
      "\"defined\"}]}]}",
      "\3{\"markups\": [{\"type\": \"ROI\", \"center\": [1, 2, 3], \"size\": [2, 3, 4], \"orientation\": "
      "[0, -1, 0, 1, 0, 0, 0, 0, 1]}, {\"type\": \"Plane\", \"normal\": [0, 0, 1], \"center\": [1, 2, 3]}]}",
      "\4# CoordinateSystem = 0\n# columns = id,x,y,z,label\na,1,2,3,\"b, c\"\n"};
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 1) return 0;
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  constexpr const char* kNames[] = {"a.nrrd", "a.nii", "a.nii.gz", "a.mrk.json", "a.fcsv"};
  const std::size_t kind = data[0] % std::size(kNames);
  kind < 3 ? takeLabels(bytes, kNames[kind]) : takeMarkups(bytes, kNames[kind]);
  return 0;
}
