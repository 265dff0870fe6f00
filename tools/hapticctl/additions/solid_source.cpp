// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/additions/solid_source.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "config/additions/addition_json.h"
#include "config/additions/addition_reader.h"
#include "config/base/descriptor.h"
#include "config/base/value_text.h"
#include "rt/base/pose.h"
#include "rt/base/rotation.h"
#include "tools/hapticctl/base/number_with_unit.h"
#include "tools/hapticctl/text/error_text.h"
#include "tools/lib/client/reply_reader.h"
#include "tools/lib/options/option_checks.h"
#include "tools/lib/solids/field/label_field.h"
#include "tools/lib/solids/field/mesh_field.h"
#include "tools/lib/solids/field/sampled_field.h"
#include "tools/lib/solids/files/mesh_reader.h"
#include "tools/lib/text/terminal_text.h"

namespace hapticd::tools {
namespace {

constexpr const char* kCommand = "hapticctl fixture add";
constexpr double kMinTolerance_m = 1e-5;
constexpr double kMaxTolerance_m = 1e-2;
/// The daemon writes the file to its disk.
constexpr std::chrono::seconds kStoreLimit{30};

/// A shape, and what a person is told about it.
struct MadeSolid {
  std::shared_ptr<const config::Solid> solid;
  rt::Vec3 low_mm, high_mm;  ///< of the body, LPS
  std::string text;
  Json document;
};

std::string joined(const std::vector<std::string>& warnings) {
  std::string text;
  for (const std::string& warning : warnings) text += fmt::format("  warning    {}\n", printable(warning));
  return text;
}

Json vectorJson(const rt::Vec3& vector) {
  return Json::array({vector.x, vector.y, vector.z});
}

/// The name of a file as the file of a solid can hold it.
std::string sourceOf(const std::string& name) {
  std::string source = base::printable(name).substr(0, config::Solid::kMaxSource);
  source.resize(base::firstInvalidUtf8(source).value_or(source.size()));  // of a character that was cut
  return source;
}

/// What every source has.
MadeSolid made(const std::string& file, solids::SampledField field, const solids::FieldReport& report,
               const rt::Vec3& low_mm, const rt::Vec3& high_mm, double tolerance_m) {
  const std::string source = std::filesystem::path(file).filename().string();
  MadeSolid result;
  result.low_mm = low_mm;
  result.high_mm = high_mm;
  const rt::Vec3 size_mm = high_mm - low_mm;
  const rt::Vec3 centre_mm = 0.5 * (low_mm + high_mm);
  result.solid = splineOf(field, {.source = sourceOf(source), .error_m = report.surface.max_m});
  const rt::DistanceGrid& grid = result.solid->grid();
  result.text = fmt::format(
      "  box        {:.1f} x {:.1f} x {:.1f} mm, centre ({:.1f}, {:.1f}, {:.1f}) mm in LPS\n"
      "  grid       {} x {} x {} samples of {:.2f} mm, {:.1f} MB\n"
      "  error      {:.3f} mm at most at the surface ({:g} mm allowed)\n",
      size_mm.x, size_mm.y, size_mm.z, centre_mm.x, centre_mm.y, centre_mm.z, grid.samples[0],
      grid.samples[1], grid.samples[2], 1000 * grid.spacing_m,
      static_cast<double>(result.solid->bytes()) / 1e6, 1000 * report.surface.max_m, 1000 * tolerance_m);
  result.document = {{"source", source},
                     {"boxLowMm", vectorJson(low_mm)},
                     {"boxHighMm", vectorJson(high_mm)},
                     {"samples", Json(grid.samples)},
                     {"spacingM", grid.spacing_m},
                     {"bytes", result.solid->bytes()},
                     {"errorM", report.surface.max_m},
                     {"toleranceM", tolerance_m}};
  return result;
}

solids::FieldOptions fieldOptions(const SolidSource& source, const Json& definition) {
  solids::FieldOptions options;
  options.tolerance_m = source.tolerance_m;
  options.clearance_m = definition.value("clearance_m", 0.0) + definition.value("soft_m", 0.0);
  options.reader = solids::splineReader;
  return options;
}

void addWarnings(MadeSolid& made, std::vector<std::string> of_file,
                 const std::vector<std::string>& of_field) {
  std::ranges::copy(of_field, std::back_inserter(of_file));
  made.text += joined(of_file);
  made.document["warnings"] = of_file;
}

base::Result<MadeSolid> fromMesh(const SolidSource& source, const Json& definition) {
  solids::MeshOptions options;
  options.frame = solids::frameOf(source.axes);
  if (!source.unit.empty())
    options.unit = source.unit == "m" ? solids::Unit::metre : solids::Unit::millimetre;
  auto mesh = solids::readMesh(source.mesh, options);
  if (!mesh) return std::unexpected(mesh.error());
  const solids::MeshReport report = mesh->report;
  const std::size_t faces = mesh->mesh.triangles.size();
  auto field = solids::fieldOfMesh(std::move(mesh->mesh), source.mesh, fieldOptions(source, definition));
  if (!field) return std::unexpected(field.error());
  MadeSolid result = made(source.mesh, std::move(field->field), field->report, report.low_mm, report.high_mm,
                          source.tolerance_m);
  result.text = fmt::format("{}: {}, {} faces, {} ({}), {} ({})\n", printable(source.mesh), report.format,
                            faces, textOf(report.frame), textOf(report.frame_from), textOf(report.unit),
                            textOf(report.unit_from)) +
                result.text;
  addWarnings(result, report.warnings, field->report.warnings);
  return result;
}

base::Result<MadeSolid> fromLabels(const SolidSource& source, const Json& definition) {
  solids::LabelOptions options;
  options.label = source.label;
  options.frame = solids::frameOf(source.axes);
  const auto labels = solids::readLabel(source.labels, options);
  if (!labels) return std::unexpected(labels.error());
  const solids::LabelReport& report = labels->report;
  auto field = solids::fieldOfLabel(labels->map, source.labels, fieldOptions(source, definition));
  if (!field) return std::unexpected(field.error());
  MadeSolid result = made(source.labels, std::move(field->field), field->report, report.low_mm,
                          report.high_mm, source.tolerance_m);
  result.text = fmt::format("{}: {}, label {}{}, {} voxels of {:g} x {:g} x {:g} mm, {} ({})\n",
                            printable(source.labels), report.format, report.value,
                            report.name.empty() ? "" : " (" + printable(report.name) + ")", report.voxels,
                            report.spacing_mm[0], report.spacing_mm[1], report.spacing_mm[2],
                            textOf(report.frame), textOf(report.frame_from)) +
                result.text +
                fmt::format(
                    "  smoothing  by a voxel; convex parts shrink by up to about {:.2f} mm, which "
                    "--clearance-m makes up for\n",
                    1000 * field->bias_bound_m);
  result.document["biasBoundM"] = field->bias_bound_m;
  addWarnings(result, report.warnings, field->report.warnings);
  return result;
}

/// A memory file of these bytes that nobody can change.
base::Result<base::Descriptor> sealed(std::string_view bytes) {
  base::Descriptor memory(::memfd_create("hapticd-solid", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  bool done = static_cast<bool>(memory);
  for (std::size_t written = 0; done && written < bytes.size();) {
    const ssize_t count = ::write(memory.get(), bytes.data() + written, bytes.size() - written);
    if (count > 0) written += static_cast<std::size_t>(count);
    done = count > 0 || (count < 0 && errno == EINTR);
  }
  constexpr int kSeals = F_SEAL_WRITE | F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL;
  if (done && ::fcntl(memory.get(), F_ADD_SEALS, kSeals) == 0) return memory;
  return std::unexpected(base::Error{kCommand,
                                     fmt::format("no memory for the shape: {}", std::strerror(errno)),
                                     "end other programs, or take a larger --tolerance"});
}

base::Error placeMissing(const MadeSolid& made) {
  const rt::Vec3 centre_m = 0.0005 * (made.low_mm + made.high_mm);
  return {kCommand,
          fmt::format("where the shape is in the world is not given: its own frame has the box's centre at "
                      "{:.3f},{:.3f},{:.3f} m",
                      centre_m.x, centre_m.y, centre_m.z),
          "give --centre-m X,Y,Z, --position-m X,Y,Z of the origin of its frame, or --landmarks"};
}

/// Lets --centre-m decide about the position.
void place(const SolidSource& source, const MadeSolid& made, config::FixtureSettings& fixture) {
  const auto component = [&](std::size_t i) { return source.centre_m[i].get<double>(); };
  const rt::Vec3 centre_m{component(0), component(1), component(2)};
  constexpr double kRadPerDeg = std::numbers::pi / 180;
  const rt::Rotation rotation = rt::rotationOf({.position_m = {},
                                                .roll_rad = fixture.rotation_deg.x * kRadPerDeg,
                                                .pitch_rad = fixture.rotation_deg.y * kRadPerDeg,
                                                .yaw_rad = fixture.rotation_deg.z * kRadPerDeg});
  fixture.position_m = centre_m - rotated(rotation, 0.0005 * (made.low_mm + made.high_mm));
}

}  // namespace

void addSolidOptions(CLI::App& command, const std::shared_ptr<SolidSource>& source) {
  CLI::Option* const mesh =
      command
          .add_option(
              "--mesh", source->mesh,
              "Take the shape (kind solid) from this surface, .stl, .obj or .ply, as 3D Slicer exports it")
          ->type_name("FILE");
  CLI::Option* const labels =
      command
          .add_option("--labels", source->labels,
                      "Take it from a segment of this label map, .nrrd, .nhdr, .seg.nrrd, .nii or .nii.gz")
          ->type_name("FILE")
          ->excludes(mesh);
  command.add_option("--label", source->label, "Name or number of the segment (default: the only one)")
      ->type_name("TEXT")
      ->needs(labels);
  command
      .add_option_function<std::string>(
          "--tolerance",
          [source](const std::string& text) {
            const auto in_metres = inUnit(text, "m");
            const auto number = in_metres ? base::numberFrom<double>(*in_metres) : std::nullopt;
            if (!number || !(*number >= kMinTolerance_m && *number <= kMaxTolerance_m))
              throw CLI::ValidationError(
                  "--tolerance", fmt::format("{} is not a length from 0.01mm to 10mm", base::inQuotes(text)));
            source->tolerance_m = *number;
          },
          "Largest error of the shape at its surface, such as 0.2mm (default 0.5mm); a smaller one takes "
          "more memory")
      ->type_name("LENGTH");
  command.add_option("--unit", source->unit, "Unit of the mesh (default: mm, where its size agrees)")
      ->type_name("WORD")
      ->check(CLI::IsMember({"mm", "m"}))
      ->needs(mesh);
  command.add_option("--axes", source->axes, "Axes of a file that does not state them: LPS (default) or RAS")
      ->type_name("WORD")
      ->check(CLI::IsMember({"LPS", "RAS"}));
  command
      .add_option_function<std::string>(
          "--centre-m",
          [source](const std::string& text) {
            const auto centre = vectorIn(text, ",");
            if (!centre)
              throw CLI::ValidationError("--centre-m",
                                         base::inQuotes(text) + " is not three numbers, such as 0,0,-0.8");
            source->centre_m = *centre;
          },
          "Put the centre of the shape's box here, instead of --position-m")
      ->type_name("X,Y,Z");
  command.add_flag("--check", source->check, "Only state the shape and its error; send nothing");
  addModelOptions(command, std::shared_ptr<ModelOptions>(source, &source->model));
  for (const char* const name : {"--tolerance", "--axes", "--centre-m", "--check", "--landmarks"})
    source->needing.push_back(command.get_option(name));
}

std::optional<int> refusedWithoutSource(const SolidSource& source, bool json) {
  const auto option =
      std::ranges::find_if(source.needing, [](const CLI::Option* given) { return given->count() > 0; });
  if (source.given() || option == source.needing.end()) return std::nullopt;
  return reportUsage(kCommand, fmt::format("{} needs --mesh or --labels", (*option)->get_name()), json);
}

int addSolid(const CommandOptions& options, const SolidSource& source, Json definition, bool replace) {
  if (definition.value("kind", "solid") != "solid" || definition.contains("solid")) {
    return reportUsage(kCommand,
                       "a shape from --mesh or --labels is of kind solid: leave out --kind and --solid",
                       options.json);
  }
  auto made = source.mesh.empty() ? fromLabels(source, definition) : fromMesh(source, definition);
  if (!made) return report(made.error(), options.json);
  if (!options.json) fmt::print("{}", made->text);
  if (source.check) {
    if (options.json) printJson(made->document);
    return kOk;
  }
  const bool of_model = !source.model.landmarks.empty();
  if (definition.contains("position_m") + !source.centre_m.is_null() + of_model != 1) {
    return report(definition.contains("position_m") || of_model
                      ? base::Error{kCommand, "the place of the shape is given twice",
                                    "give one of --centre-m, --position-m and --landmarks"}
                      : placeMissing(*made),
                  options.json);
  }
  const std::string_view bytes = made->solid->file();
  // The daemon would read it again; this says what is wrong before anything is sent.
  if (const auto good = config::solidFrom(bytes, made->document["source"].get<std::string>()); !good)
    return report(good.error(), options.json);

  definition["kind"] = "solid";
  definition["solid"] = std::string(64, '0');  // until the box has named it
  if (!definition.contains("position_m")) definition["position_m"] = {0, 0, 0};
  auto fixtures =
      config::definitionsFrom<config::FixtureSettings>(config::nodeOf(Json::array({definition})), "");
  if (!fixtures) return reportProblems(fixtures.error(), options.json);
  config::SceneAdditions additions{.fixtures = std::move(*fixtures)};
  if (!source.centre_m.is_null()) place(source, *made, additions.fixtures.front());
  if (of_model) {
    auto in_world = registered(options, source.model, additions, made->document);
    if (!in_world) return in_world.error();
    additions = std::move(*in_world);
  }
  const auto memory = sealed(bytes);
  if (!memory) return report(memory.error(), options.json);
  const auto stored =
      callOnce(options, {"io.hapticd.Control.StoreSolid", Json::object(), true, kStoreLimit, memory->get()});
  if (!stored) return report(stored.error(), options.json);
  additions.fixtures.front().solid = stored->value("solid", "");
  return addAll(options, kFixtures, definitionsIn(kFixtures, additions), replace,
                "added " + printable(additions.fixtures.front().name), made->document);
}

}  // namespace hapticd::tools
