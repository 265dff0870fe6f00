// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/solids/files/label_reader.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.h"
#include "tests/unit/tools/solids/made_up_solids.h"

// Label maps of all variants, written here.
namespace hapticd::solids {
namespace {

using rt::Vec3;

constexpr double kRounding_m = 1e-8;  // of the floats of NIfTI, which are of up to 0.06 m here

/// Sizes, directions and origin of a left-handed image, with one voxel that is set.
constexpr std::array<int, 3> kSizes{120, 90, 40};
constexpr std::array<int, 3> kVoxel{10, 20, 8};
const Vec3 kPlace_m{-0.065, 0.055, -0.020};
const std::vector<std::string> kOrientation{"space: left-posterior-superior",
                                            "space directions: (-0.5,0,0) (0,0.5,0) (0,0,1.25)",
                                            "space origin: (-60,45,-30)"};

std::string voxelsWith(int value) {
  std::string voxels(static_cast<std::size_t>(kSizes[0]) * kSizes[1] * kSizes[2], '\0');
  voxels[static_cast<std::size_t>(kVoxel[0] + kSizes[0] * (kVoxel[1] + kSizes[1] * kVoxel[2]))] =
      static_cast<char>(value);
  return voxels;
}

std::vector<std::string> withLines(std::vector<std::string> lines, const std::vector<std::string>& more) {
  lines.insert(lines.end(), more.begin(), more.end());
  return lines;
}
const std::vector<std::string> kShape{"type: uchar", "dimension: 3", "sizes: 120 90 40"};

/// Where the only voxel of the segment is.
void expectTheVoxel(const base::Result<LabelFile>& file, const std::string& what) {
  ASSERT_TRUE(file) << what << ": " << file.error().text();
  EXPECT_EQ(file->report.voxels, 1U) << what;
  EXPECT_LT(norm(1e-3 * file->report.low_mm - kPlace_m), kRounding_m) << what;
  const LabelMap& map = file->map;
  ASSERT_EQ(map.size, (std::array<int, 3>{3, 3, 3})) << what;
  for (std::size_t i = 0; i < 27; ++i) EXPECT_EQ(map.inside[i], i == 13 ? 1 : 0) << what;
  EXPECT_LT(norm(map.centreOf(1, 1, 1) - kPlace_m), kRounding_m) << what;
  EXPECT_LT(norm(map.steps_m[0] - Vec3{-0.0005, 0, 0}), kRounding_m) << what;
  EXPECT_LT(norm(map.steps_m[2] - Vec3{0, 0, 0.00125}), kRounding_m) << what;
}

TEST(LabelReader, PlacesVoxelsOfNrrdByTheirCentres) {
  const std::string voxels = voxelsWith(3), packed = test::gzipped(voxels);
  const std::vector<std::string> all = withLines(kShape, kOrientation);
  expectTheVoxel(labelFrom(test::nrrdHeader(withLines(all, {"encoding: raw"})) + voxels, "a.nrrd"), "raw");
  expectTheVoxel(labelFrom(test::nrrdHeader(withLines(all, {"encoding: gzip"})) + packed, "a.nrrd"), "gzip");
  const std::string members = test::gzipped(voxels.substr(0, 1000)) + test::gzipped(voxels.substr(1000));
  expectTheVoxel(labelFrom(test::nrrdHeader(withLines(all, {"encoding: gz"})) + members, "a.nrrd"),
                 "two members");
  std::string crlf = test::nrrdHeader(withLines(all, {"# comment", "encoding: raw"}));
  for (std::size_t at = 0; (at = crlf.find('\n', at)) != std::string::npos; at += 2) crlf.insert(at, "\r");
  expectTheVoxel(labelFrom(crlf + voxels, "a.nrrd"), "CRLF");
  expectTheVoxel(
      labelFrom(test::nrrdHeader(withLines(all, {"encoding: raw", "line skip: 2", "byte skip: 3"})) +
                    "one\ntwo\n123" + voxels,
                "a.nrrd"),
      "skips");
  expectTheVoxel(labelFrom(test::nrrdHeader(withLines(all, {"encoding: raw", "byte skip: -1"})) +
                               "of any length" + voxels,
                           "a.nrrd"),
                 "last bytes");
}

TEST(LabelReader, PlacesVoxelsOfRasAndOfSpacingsAlike) {
  const std::string voxels = voxelsWith(1);
  expectTheVoxel(labelFrom(test::nrrdHeader(withLines(
                               kShape, {"space: RAS", "space directions: (0.5,0,0) ( 0, -0.5, 0 ) (0,0,1.25)",
                                        "space origin: (60,-45,-30)", "encoding: raw"})) +
                               voxels,
                           "a.nrrd"),
                 "RAS");
  const std::string plain =
      test::nrrdHeader(withLines(kShape, {"spacings: 0.5 0.5 1.25", "encoding: raw"})) + voxels;
  EXPECT_FALSE(labelFrom(plain, "a.nrrd"));
  LabelOptions options;
  options.frame = Frame::lps;
  const auto given = labelFrom(plain, "a.nrrd", options);
  ASSERT_TRUE(given) << given.error().text();
  EXPECT_EQ(given->report.frame_from, KnownFrom::option);
  EXPECT_LT(norm(given->report.low_mm - Vec3{5, 10, 10}), 1e-9);
}

test::MadeUpNifti nifti() {
  test::MadeUpNifti file;
  file.dim = {3, 120, 90, 40, 1, 1, 1, 1};
  file.voxels = voxelsWith(1);
  return file;
}
test::MadeUpNifti withQform() {
  test::MadeUpNifti file = nifti();
  file.qform_code = 1;
  file.quatern = {1, 0, 0};
  file.pixdim = {-1, 0.5F, 0.5F, 1.25F, 0, 0, 0, 0};
  file.qoffset = {60, -45, -30};
  return file;
}
test::MadeUpNifti withSform() {
  test::MadeUpNifti file = nifti();
  file.sform_code = 1;
  file.pixdim = {1, 9, 9, 9, 0, 0, 0, 0};  // unused
  file.srow = {0.5F, 0, 0, 60, 0, -0.5F, 0, -45, 0, 0, 1.25F, -30};
  return file;
}

TEST(LabelReader, PlacesVoxelsOfNiftiByBothMethods) {
  // quaternion (b, c, d) = (1, 0, 0) turns y and z; qfac -1 turns z back, so x is turned to the left
  expectTheVoxel(labelFrom(withQform().file(), "a.nii"), "qform");
  expectTheVoxel(labelFrom(withSform().file(), "a.nii"), "sform");
  expectTheVoxel(labelFrom(withSform().file(std::endian::big), "a.nii"), "big endian");
  expectTheVoxel(labelFrom(test::gzipped(withQform().file()), "a.nii.gz"), "compressed");
  expectTheVoxel(labelFrom(test::gzipped(withQform().file()), "a.nii"), "compressed with another ending");
  test::MadeUpNifti both = withSform();
  const test::MadeUpNifti q = withQform();
  both.qform_code = 1;
  both.quatern = q.quatern;
  both.pixdim = q.pixdim;
  both.qoffset = q.qoffset;
  const auto alike = labelFrom(both.file(), "a.nii");
  expectTheVoxel(alike, "both");
  EXPECT_TRUE(alike->report.warnings.empty());
  both.qoffset[0] += 0.1F;
  const auto different = labelFrom(both.file(), "a.nii");
  expectTheVoxel(different, "sform wins");
  EXPECT_EQ(different->report.warnings.size(), 1U);
}

TEST(LabelReader, ConvertsTheUnitOfNifti) {
  test::MadeUpNifti file = withSform();
  for (float& number : file.srow) number /= 1000;
  file.xyzt_units = 1 + 8;  // metres, seconds
  expectTheVoxel(labelFrom(file.file(), "a.nii"), "m");
  file = withSform();
  for (float& number : file.srow) number *= 1000;
  file.xyzt_units = 3;
  const auto um = labelFrom(file.file(), "a.nii");
  ASSERT_TRUE(um);
  EXPECT_LT(norm(1e-3 * um->report.low_mm - kPlace_m), kRounding_m);
  file = withSform();
  file.xyzt_units = 0;
  const auto unknown = labelFrom(file.file(), "a.nii");
  expectTheVoxel(unknown, "unknown");
  EXPECT_EQ(unknown->report.warnings.size(), 1U);
}

TEST(LabelReader, RefusesNiftiThatItWouldMisread) {
  const auto refuses = [](const test::MadeUpNifti& file, const std::string& what) {
    const auto read = labelFrom(file.file(), "a.nii");
    ASSERT_FALSE(read) << what;
    EXPECT_FALSE(read.error().remedy.empty()) << what;
    EXPECT_TRUE(read.error().where.starts_with("a.nii")) << what;
  };
  refuses(nifti(), "no orientation");
  test::MadeUpNifti file = withSform();
  file.scl_slope = 2;
  refuses(file, "scaled");
  file = withSform();
  file.scl_inter = 1;
  refuses(file, "shifted");
  file = withSform();
  file.magic = std::string("ni1\0", 4);
  refuses(file, "pair of files");
  file = withSform();
  file.dim = {4, 120, 90, 40, 2, 1, 1, 1};
  refuses(file, "sequence");
  for (const std::int16_t size : {std::int16_t{0}, std::int16_t{-5}, std::int16_t{32767}}) {
    file = withSform();
    file.dim[2] = size;
    refuses(file, "size");
  }
  file = withSform();
  file.datatype = 128;
  refuses(file, "colour");
  for (const float offset : {0.F, -1.F, 1e30F, 352.5F, std::nanf("")}) {
    file = withSform();
    file.vox_offset = offset;
    refuses(file, "offset");
  }
  file = withSform();
  file.srow[10] = 0;  // no step along z
  refuses(file, "flat");
  file.srow[10] = std::nanf("");
  refuses(file, "not a number");
  EXPECT_FALSE(labelFrom(std::string(400, '\0'), "a.nii"));
}

TEST(LabelReader, DoesNotTakeNumbersOfNiftiThatMeanNothing) {
  test::MadeUpNifti file = withQform();
  for (std::size_t axis = 1; axis <= 3; ++axis) file.pixdim[axis] = -file.pixdim[axis];
  file.scl_slope = file.scl_inter = std::nanf("");
  const auto read = labelFrom(file.file(), "a.nii");
  expectTheVoxel(read, "spacings have no sign");
  ASSERT_EQ(read->report.warnings.size(), 1U);
  EXPECT_NE(read->report.warnings[0].find("negative"), std::string::npos);
  file.quatern = {0, 0, 1.2F};
  EXPECT_FALSE(labelFrom(file.file(), "a.nii"));
  file.sform_code = 1;
  file.srow = withSform().srow;
  expectTheVoxel(labelFrom(file.file(), "a.nii"), "the quaternion is not used");
}

TEST(LabelReader, SaysThatTheFrameOfTheFileDecides) {
  LabelOptions options;
  options.frame = Frame::lps;
  const auto read = labelFrom(withSform().file(), "a.nii", options);
  expectTheVoxel(read, "RAS");
  ASSERT_EQ(read->report.warnings.size(), 1U);
  EXPECT_NE(read->report.warnings[0].find("ignored"), std::string::npos);
}

template <typename Number>
std::string voxelsOf(std::size_t count, std::size_t at, Number value, std::endian order) {
  std::string voxels;
  for (std::size_t i = 0; i < count; ++i) voxels += test::bytesOf(i == at ? value : Number{}, order);
  return voxels;
}

TEST(LabelReader, ReadsEachTypeInBothByteOrders) {
  for (const std::endian order : {std::endian::little, std::endian::big}) {
    const std::vector<std::pair<std::string, std::string>> types{
        {"int8", voxelsOf<std::int8_t>(60, 31, -5, order)},
        {"unsigned char", voxelsOf<std::uint8_t>(60, 31, 251, order)},
        {"short", voxelsOf<std::int16_t>(60, 31, -300, order)},
        {"uint16_t", voxelsOf<std::uint16_t>(60, 31, 40000, order)},
        {"int", voxelsOf<std::int32_t>(60, 31, -70000, order)},
        {"unsigned int", voxelsOf<std::uint32_t>(60, 31, 3'000'000'000U, order)},
        {"long long", voxelsOf<std::int64_t>(60, 31, -5'000'000'000, order)},
        {"uint64", voxelsOf<std::uint64_t>(60, 31, 5'000'000'000U, order)},
        {"float", voxelsOf<float>(60, 31, 7.0004F, order)},
        {"double", voxelsOf<double>(60, 31, 6.9999, order)}};
    const std::vector<std::string> values{"-5",         "251",         "-300",       "40000", "-70000",
                                          "3000000000", "-5000000000", "5000000000", "7",     "7"};
    for (std::size_t i = 0; i < types.size(); ++i) {
      const std::string header =
          test::nrrdHeader({"type: " + types[i].first, "dimension: 3", "sizes: 5 4 3", "space: LPS",
                            "space directions: (1,0,0) (0,1,0) (0,0,1)", "space origin: (0,0,0)",
                            order == std::endian::big ? "endian: big" : "endian: little", "encoding: raw"});
      LabelOptions options;
      options.label = values[i];
      const auto file = labelFrom(header + types[i].second, "a.nrrd", options);
      ASSERT_TRUE(file) << types[i].first << ": " << file.error().text();
      EXPECT_EQ(file->report.low_mm, (Vec3{1, 2, 1})) << types[i].first;  // 31 = 1 + 5 (2 + 4)
    }
  }
}

/// A segmentation with two layers of 4 x 3 x 2 voxels, the list axis first. Both use the value 1.
std::string layered(const std::string& representation = "Binary labelmap") {
  std::string voxels(48, '\0');
  const auto set = [&](int layer, int x, int y, int z, char value) {
    voxels[static_cast<std::size_t>(layer + 2 * (x + 4 * (y + 3 * z)))] = value;
  };
  set(0, 1, 1, 0, 1);
  set(0, 2, 1, 0, 2);
  set(1, 3, 2, 1, 1);
  return test::nrrdHeader({"type: unsigned char",
                           "dimension: 4",
                           "sizes: 2 4 3 2",
                           "kinds: list domain domain domain",
                           "space: LPS",
                           "space directions: none (1,0,0) (0,1,0) (0,0,1)",
                           "space origin: (0,0,0)",
                           "encoding: raw",
                           "Segment0_ID:=Segment_1",
                           "Segment0_Name:=Skull",
                           "Segment0_LabelValue:=1",
                           "Segment0_Layer:=0",
                           "Segment1_ID:=Segment_2",
                           "Segment1_Name:=facial nerve: left",
                           "Segment1_LabelValue:=1",
                           "Segment1_Layer:=1",
                           "Segment2_ID:=Segment_3",
                           "Segment2_Name:=tumour",
                           "Segment2_LabelValue:=2",
                           "Segment2_Layer:=0",
                           "Segment3_ID:=Segment_4",
                           "Segment3_Name:=nothing",
                           "Segment3_LabelValue:=9",
                           "Segment3_Layer:=1",
                           "Segmentation_ReferenceImageExtentOffset:=-5 0 0",
                           "Segmentation_SourceRepresentation:=" + representation}) +
         voxels;
}

TEST(LabelReader, ChoosesSegmentsByNameIdOrValueInTheirLayer) {
  const auto placeOf = [](const std::string& label) {
    LabelOptions options;
    options.label = label;
    const auto file = labelFrom(layered(), "a.seg.nrrd", options);
    EXPECT_TRUE(file) << label << ": " << (file ? "" : file.error().text());
    return file ? file->report.low_mm : Vec3{-1, -1, -1};
  };
  EXPECT_EQ(placeOf("Skull"), (Vec3{1, 1, 0}));
  EXPECT_EQ(placeOf("skull"), (Vec3{1, 1, 0}));
  EXPECT_EQ(placeOf("facial nerve: left"), (Vec3{3, 2, 1}));
  EXPECT_EQ(placeOf("Segment_2"), (Vec3{3, 2, 1}));
  EXPECT_EQ(placeOf("2"), (Vec3{2, 1, 0}));
}

TEST(LabelReader, NamesTheLabelsWhereTheChoiceIsNotClear) {
  for (const std::string label : {"", "1", "liver"}) {
    LabelOptions options;
    options.label = label;
    const auto file = labelFrom(layered(), "a.seg.nrrd", options);
    ASSERT_FALSE(file) << label;
    EXPECT_NE(file.error().remedy.find("Skull"), std::string::npos) << file.error().text();
  }
  LabelOptions empty;
  empty.label = "nothing";
  EXPECT_FALSE(labelFrom(layered(), "a.seg.nrrd", empty));
  EXPECT_FALSE(labelFrom(layered("Fractional labelmap"), "a.seg.nrrd", empty));
}

TEST(LabelReader, SaysWhetherTheImageCutsTheSegmentOff) {
  LabelOptions options;
  options.label = "tumour";
  options.margin_voxels = 4;  // beyond the image, which has 3 x 4 x 2 voxels
  const auto file = labelFrom(layered(), "a.seg.nrrd", options);
  ASSERT_TRUE(file);
  EXPECT_TRUE(file->report.touches_edge);
  EXPECT_EQ(file->map.size, (std::array<int, 3>{9, 9, 9}));
  EXPECT_EQ(file->map.centreOf(4, 4, 4), (Vec3{0.002, 0.001, 0}));
}

TEST(LabelReader, RefusesAnImage) {
  std::string voxels;
  for (int i = 0; i < 20 * 20 * 20; ++i) voxels += test::bytesOf(static_cast<std::int16_t>(i));
  const auto file =
      labelFrom(test::nrrdHeader({"type: short", "dimension: 3", "sizes: 20 20 20", "space: LPS",
                                  "endian: little", "space directions: (1,0,0) (0,1,0) (0,0,1)",
                                  "space origin: (0,0,0)", "encoding: raw"}) +
                    voxels,
                "a.nrrd");
  ASSERT_FALSE(file);
  EXPECT_NE(file.error().what.find("image"), std::string::npos);
}

TEST(LabelReader, ReadsDetachedVoxelsFromTheFolderOnly) {
  const test::TemporaryFolder folder;
  const std::vector<std::string> all = withLines(withLines(kShape, kOrientation), {"encoding: raw"});
  folder.write("voxels.raw", voxelsWith(1));
  expectTheVoxel(
      readLabel(folder.write("a.nhdr", test::nrrdHeader(withLines(all, {"data file: voxels.raw"})))),
      "detached");
  for (const std::string other :
       {"../voxels.raw", "/etc/passwd", "voxels%03d.raw 1 2 1", "LIST", "missing.raw"})
    EXPECT_FALSE(readLabel(folder.write("b.nhdr", test::nrrdHeader(withLines(all, {"data file: " + other})))))
        << other;
  EXPECT_FALSE(labelFrom(test::nrrdHeader(withLines(all, {"data file: voxels.raw"})), "a.nhdr"));
  const test::TemporaryFolder other_folder;
  std::filesystem::create_symlink(other_folder.write("voxels.raw", voxelsWith(1)),
                                  folder.path() / "link.raw");
  const auto linked =
      readLabel(folder.write("c.nhdr", test::nrrdHeader(withLines(all, {"data file: link.raw"}))));
  ASSERT_FALSE(linked);
  EXPECT_NE(linked.error().text().find("outside"), std::string::npos) << linked.error().text();
}

TEST(LabelReader, RefusesHostileHeadersWithoutAllocating) {
  const std::vector<std::vector<std::string>> hostile{{"sizes: 4096 4096 4096"},
                                                      {"sizes: 4294967296 4294967296 4294967296"},
                                                      {"sizes: 9223372036854775807 2 1"},
                                                      {"sizes: 0 1 1"},
                                                      {"sizes: -1 1 1"},
                                                      {"sizes: 1 1"},
                                                      {"dimension: 2"},
                                                      {"dimension: 99999999999"},
                                                      {"dimension: 4", "sizes: 4096 4096 4096 4096"},
                                                      {"type: block"},
                                                      {"type: short"},
                                                      {"encoding: hex"},
                                                      {"encoding: bzip2"},
                                                      {"byte skip: 9223372036854775807"},
                                                      {"byte skip: -2"},
                                                      {"line skip: -1"},
                                                      {"encoding: gzip", "byte skip: -1"},
                                                      {"space: left-anterior-superior"},
                                                      {"space directions: (1,0,0) (1,0,0) (0,0,1)"},
                                                      {"space directions: (0,0,0) (0,1,0) (0,0,1)"},
                                                      {"space directions: (1e300,0,0) (0,1,0) (0,0,1)"},
                                                      {"space directions: (nan,0,0) (0,1,0) (0,0,1)"},
                                                      {"space directions: (1,0) (0,1,0) (0,0,1)"},
                                                      {"space directions: none (0,1,0) (0,0,1)"},
                                                      {"space origin: (1,2)"},
                                                      {"space origin: (1e8,0,0)"},
                                                      {"space units: \"m\" \"m\" \"m\""}};
  for (const std::vector<std::string>& lines : hostile) {
    // a later line replaces an earlier one
    const std::string file =
        test::nrrdHeader(
            withLines({"type: uchar", "dimension: 3", "sizes: 2 2 2", "space: LPS",
                       "space directions: (1,0,0) (0,1,0) (0,0,1)", "space origin: (0,0,0)", "encoding: raw"},
                      lines)) +
        std::string("\0\0\1\0\0\0\0\0", 8);
    const auto read = labelFrom(file, "a.nrrd");
    ASSERT_FALSE(read) << lines[0];
    EXPECT_TRUE(read.error().where.starts_with("a.nrrd")) << lines[0];
    EXPECT_FALSE(read.error().what.empty() || read.error().remedy.empty()) << lines[0];
  }
}

TEST(LabelReader, RefusesMoreCompressedDataThanItsLimit) {
  LabelOptions options;
  options.limits.voxel_bytes = 1000;
  const std::string header = test::nrrdHeader(withLines(withLines(kShape, kOrientation), {"encoding: gzip"}));
  EXPECT_FALSE(labelFrom(header + test::gzipped(voxelsWith(1)), "a.nrrd", options));
}

/// Voxels are decompressed piece by piece; what is kept of them is limited by the size of the file.
TEST(LabelReader, RefusesASegmentWhoseBoxIsFarLargerThanItsFile) {
  std::string voxels(std::size_t{520} * 520 * 520, '\0');
  voxels.front() = voxels.back() = 1;
  const auto read = labelFrom(test::nrrdHeader({"type: uchar", "dimension: 3", "sizes: 520 520 520",
                                                "space: LPS", "space directions: (1,0,0) (0,1,0) (0,0,1)",
                                                "space origin: (0,0,0)", "encoding: gzip"}) +
                                  test::gzipped(voxels),
                              "bomb.nrrd");
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().where, "bomb.nrrd");
  EXPECT_NE(read.error().what.find("of this file"), std::string::npos) << read.error().text();
}

TEST(LabelReader, RefusesATruncationAtEveryByte) {
  LabelOptions options;
  options.label = "tumour";
  const std::string raw = layered();
  const std::size_t head = raw.find("\n\n") + 2;
  std::string packed = raw;
  packed.replace(packed.find("encoding: raw"), 13, "encoding: gzip");
  packed = packed.substr(0, packed.find("\n\n") + 2) + test::gzipped(raw.substr(head));
  test::MadeUpNifti small;
  small.dim = {3, 3, 2, 2, 1, 1, 1, 1};
  small.sform_code = 1;
  small.srow = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  small.voxels = std::string("\0\0\2\0\0\0\0\0\0\0\0\0", 12);
  for (const auto& [name, bytes] :
       {std::pair{std::string("a.nrrd"), raw}, std::pair{std::string("a.nrrd"), packed},
        std::pair{std::string("a.nii"), small.file()},
        std::pair{std::string("a.nii.gz"), test::gzipped(small.file())}}) {
    if (name == "a.nii") options.label = "2";
    ASSERT_TRUE(labelFrom(bytes, name, options)) << labelFrom(bytes, name, options).error().text();
    for (std::size_t size = 0; size < bytes.size(); ++size) {
      const auto file = labelFrom(bytes.substr(0, size), name, options);
      ASSERT_FALSE(file) << name << " " << size;
      EXPECT_TRUE(file.error().where.starts_with(name)) << file.error().text();
      EXPECT_FALSE(file.error().remedy.empty()) << file.error().text();
    }
  }
}

}  // namespace
}  // namespace hapticd::solids
