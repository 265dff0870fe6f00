// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticctl/additions/addition_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "config/additions/addition_json.h"
#include "config/additions/addition_reader.h"
#include "config/base/program.h"
#include "tools/hapticctl/additions/handle_touch.h"
#include "tools/hapticctl/text/error_text.h"
#include "tools/lib/client/reply_reader.h"
#include "tools/lib/options/option_checks.h"
#include "tools/lib/registration/shape_fit.h"
#include "tools/lib/registration/touch.h"

namespace hapticd::tools {
namespace {

using base::Error;
using rt::Vec3;
using Points = std::vector<Vec3>;

constexpr const char* kCommand = "fixture touch";

constexpr int kPlaneTouches = 4;   // one more than needed, so that there is a residual
constexpr int kSphereTouches = 6;  // two more
constexpr std::size_t kBoxTouches = 4;
constexpr std::array<const char*, kBoxTouches> kBoxPlaces{
    "the first corner of a face of the box", "the next corner along an edge of this face",
    "the next corner along the next edge of this face", "any point of the opposite face"};

struct TouchOptions {
  std::string name;
  std::string kind;
  std::string touched;  ///< file with points; empty: they are touched
  int points = 0;       ///< to touch; 0: as many as the kind needs and one or two more
  double seconds = 0;   ///< of a stroke; 0: while a button is held
  double tolerance_m = 0.001;
  double most_residual_m = 0.005;
  bool replace = false;
};

/// A fitted shape as members of a fixture.
struct Measured {
  Json members;
  Residuals residuals;
  std::string remark;  ///< about the fit; may be empty
};

Json jsonOf(const Vec3& v) {
  return {v.x, v.y, v.z};
}

Json jsonOf(const Points& points_m) {
  Json points = Json::array();
  for (const Vec3& point : points_m) points.push_back(jsonOf(point));
  return points;
}

// --- points

std::expected<Points, int> pointsIn(const CommandOptions& options, const std::string& file) {
  const auto content = contentOf(options, file);
  if (!content) return std::unexpected(content.error());
  const auto read = pointsFromText(*content, file);
  if (!read) return std::unexpected(report(read.error(), options.json));
  Points points_m;
  for (const Json& point : *read)
    points_m.push_back({point[0].get<double>(), point[1].get<double>(), point[2].get<double>()});
  return points_m;
}

std::string placeOf(const TouchOptions& requested, std::size_t index, std::size_t count) {
  if (requested.kind == "box") return kBoxPlaces[index];
  return fmt::format("point {} of {} on the {}", index + 1, count, requested.kind);
}

std::expected<Points, int> touchedPoints(const CommandOptions& options, const TouchOptions& requested) {
  auto client = connectTo(options, false);
  if (!client) return std::unexpected(report(client.error(), options.json));
  const Toucher toucher{*client, kCommand, options.json};
  if (requested.kind == "path") return stroke(toucher, std::chrono::duration<double>(requested.seconds));
  const int usual = requested.kind == "plane" ? kPlaneTouches : kSphereTouches;
  const std::size_t count = requested.kind == "box"
                                ? kBoxTouches
                                : static_cast<std::size_t>(requested.points > 0 ? requested.points : usual);
  Points points_m;
  while (points_m.size() < count) {
    const auto place = touch(toucher, placeOf(requested, points_m.size(), count), false);
    if (!place) return std::unexpected(place.error());
    if (*place) points_m.push_back(**place);
  }
  return points_m;
}

// --- shapes

/// Where the camera is, from where the visible side of a plane is.
std::expected<Vec3, int> cameraInWorld(const CommandOptions& options) {
  const auto reply = callOnce(options, {"io.hapticd.Status.GetCalibration"});
  if (!reply) return std::unexpected(report(reply.error(), options.json));
  return Vec3{numberAt(*reply, "calibration.cameraPose.xM"), numberAt(*reply, "calibration.cameraPose.yM"),
              numberAt(*reply, "calibration.cameraPose.zM")};
}

Measured measuredOf(const FittedPlane& fit) {
  return {Json::object({{"position_m", jsonOf(fit.position_m)}, {"normal", jsonOf(fit.normal)}}),
          fit.residuals, "the normal points towards the camera"};
}

Measured measuredOf(const FittedSphere& fit) {
  return {Json::object({{"position_m", jsonOf(fit.position_m)}, {"radius_m", fit.radius_m}}), fit.residuals,
          fmt::format("the radius is {:.1f} mm", 1000 * fit.radius_m)};
}

Measured measuredOf(const FittedBox& fit) {
  return {Json::object({{"position_m", jsonOf(fit.position_m)},
                        {"size_m", jsonOf(fit.size_m)},
                        {"rotation_deg", jsonOf(fit.rotation_deg)}}),
          fit.residuals,
          fmt::format("the edges are {:.1f}, {:.1f} and {:.1f} mm", 1000 * fit.size_m.x, 1000 * fit.size_m.y,
                      1000 * fit.size_m.z)};
}

Measured measuredOf(const StrokePath& path) {
  Json members = Json::object();
  members["points_m"] = jsonOf(path.points_m);
  return {std::move(members), path.residuals,
          fmt::format("{} points over {:.0f} mm, simplified within {:.2f} mm", path.points_m.size(),
                      1000 * path.length_m, 1000 * path.tolerance_m)};
}

template <typename Fit>
base::Result<Measured> measuredOf(const base::Result<Fit>& fit) {
  if (!fit) return std::unexpected(fit.error());
  return measuredOf(*fit);
}

base::Result<Measured> measured(const TouchOptions& requested, const Points& points_m,
                                const Vec3& camera_m_in_world) {
  if (requested.kind == "plane") return measuredOf(fitPlane(points_m, camera_m_in_world));
  if (requested.kind == "sphere") return measuredOf(fitSphere(points_m));
  if (requested.kind == "path") return measuredOf(pathOf(points_m, requested.tolerance_m));
  if (points_m.size() == kBoxTouches)
    return measuredOf(fitBox({points_m[0], points_m[1], points_m[2]}, points_m[3]));
  return std::unexpected(Error{"box", fmt::format("{} points, {} are needed", points_m.size(), kBoxTouches),
                               "three corners of a face in order, then a point of the opposite face"});
}

/// Members that stand for those that are measured later, so that all others can be checked before.
Json anyShape(const std::string& kind) {
  Json shape = Json::object();
  if (kind == "path") {
    shape["points_m"] = jsonOf(Points{{0, 0, 0}, {1, 0, 0}});
    return shape;
  }
  shape["position_m"] = jsonOf(Vec3{});
  if (kind == "plane") shape["normal"] = jsonOf(Vec3{0, 0, 1});
  if (kind == "sphere") shape["radius_m"] = 1;
  if (kind == "box") shape["size_m"] = jsonOf(Vec3{1, 1, 1});
  return shape;
}

/// Checks a definition as the daemon does. Errors: reported, with the exit code.
std::expected<void, int> check(const CommandOptions& options, const Json& definition) {
  const auto fixtures =
      config::definitionsFrom<config::FixtureSettings>(config::nodeOf(Json::array({definition})), kCommand);
  if (fixtures) return {};
  return std::unexpected(reportProblems(fixtures.error(), options.json));
}

/// Whether the name is free, or may be replaced; before the person has touched anything.
std::expected<void, int> checkName(const CommandOptions& options, const TouchOptions& requested) {
  const auto reply = callOnce(options, {kFixtures.list_method});
  if (!reply) return std::unexpected(report(reply.error(), options.json));
  const auto isIt = [&](const Json& entry) { return textAt(entry, "name") == requested.name; };
  if (requested.replace || std::ranges::none_of(entriesOf(kFixtures, *reply), isIt)) return {};
  return std::unexpected(report(
      Error{printable(requested.name), "there is a fixture of this name", "choose another, or --replace"},
      options.json));
}

void show(const Measured& found) {
  const auto line = [](const std::string& name, double metres) {
    fmt::print("  {:<20} {:>7} mm\n", name, fixed(1000 * metres, 2));
  };
  fmt::print("residuals\n");
  constexpr std::size_t kMaxShown = 16;  // the readings of a stroke are hundreds
  if (found.residuals.each_m.size() <= kMaxShown) {
    for (std::size_t i = 0; i < found.residuals.each_m.size(); ++i)
      line(fmt::format("point {}", i + 1), found.residuals.each_m[i]);
  }
  line("root mean square", found.residuals.rms_m);
  line("largest", found.residuals.largest_m);
  fmt::print("{}\n", found.remark);
}

int touchFixture(const CommandOptions& options, const TouchOptions& requested, const Json& members) {
  const bool counted = requested.kind == "plane" || requested.kind == "sphere";
  if (requested.points > 0 && !counted) {
    return reportUsage("hapticctl fixture touch", "--points belongs to the kinds plane and sphere",
                       options.json);
  }
  Json definition = members;
  definition["name"] = requested.name;
  definition["kind"] = requested.kind;
  Json trial = anyShape(requested.kind);
  trial.update(definition);
  if (const auto good = check(options, trial); !good) return good.error();
  if (const auto good = checkName(options, requested); !good) return good.error();

  Vec3 camera_m_in_world;
  if (requested.kind == "plane") {
    const auto camera = cameraInWorld(options);
    if (!camera) return camera.error();
    camera_m_in_world = *camera;
  }
  const auto points_m =
      requested.touched.empty() ? touchedPoints(options, requested) : pointsIn(options, requested.touched);
  if (!points_m) return points_m.error();
  const auto found = measured(requested, *points_m, camera_m_in_world);
  if (!found) return report(found.error(), options.json);
  if (!options.json) show(*found);
  if (found->residuals.largest_m > requested.most_residual_m) {
    return report(Error{kCommand,
                        fmt::format("nothing was changed: a point is off by {:.1f} mm, at most {:.1f} mm are "
                                    "allowed",
                                    1000 * found->residuals.largest_m, 1000 * requested.most_residual_m),
                        "touch the points again, or --most-residual-m"},
                  options.json);
  }
  definition.update(found->members);
  if (const auto good = check(options, definition); !good) return good.error();
  const Json document{
      {"fixture", definition}, {"rmsM", found->residuals.rms_m}, {"largestM", found->residuals.largest_m}};
  return addAll(options, kFixtures, Json::array({definition}), requested.replace,
                "added " + printable(requested.name), document);
}

}  // namespace

void addFixtureTouch(CommandLine& line, CLI::App&) {
  const CommandOptions& options = line.options();
  const auto requested = std::make_shared<TouchOptions>();
  const auto members = std::make_shared<Json>(Json::object());
  CLI::App& command =
      line.addHelped("fixture touch", [=, &options] { return touchFixture(options, *requested, *members); });
  command.add_option("NAME", requested->name, "Its name: 1 to 32 letters, digits, '_' and '-'")
      ->type_name("TEXT")
      ->required();
  command.add_option("--kind", requested->kind, "What the fixture is")
      ->type_name("WORD")
      ->required()
      ->check(CLI::IsMember({"plane", "sphere", "box", "path"}));
  auto* points = command
                     .add_option("--points", requested->points,
                                 "Number of points to touch on a plane (default 4) or a sphere (default 6)")
                     ->type_name("N")
                     ->check(within(3, 100));
  auto* seconds =
      command
          .add_option("--seconds", requested->seconds,
                      "Record the stroke of a path for this long, instead of while a button is held")
          ->type_name("S")
          ->check(within(0.1, 300.0));
  command
      .add_option("--tolerance-m", requested->tolerance_m,
                  "Simplify a path within this distance (default 0.001)")
      ->type_name("M")
      ->check(within(0.0001, 0.1));
  command
      .add_option("--most-residual-m", requested->most_residual_m,
                  "Refuse a shape that leaves a point farther off than this (default 0.005)")
      ->type_name("M")
      ->check(within(0.0, 1.0));
  command
      .add_option("--touched", requested->touched,
                  "Take the points from this file instead: x y z in the world on each line")
      ->type_name("FILE")
      ->excludes(points)
      ->excludes(seconds);
  command.add_flag("--replace", requested->replace, "Replace the fixture of this name");
  static constexpr std::array<std::string_view, 13> kMeasured{
      "kind",           "frame",    "position_m",   "normal",           "axis",
      "end_m",          "size_m",   "rotation_deg", "orientation_xyzw", "radius_m",
      "half_angle_deg", "points_m", "solid"};
  addMembers(command, kFixtures, members, kMeasured);
}

}  // namespace hapticd::tools
