// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/registration/model_registration.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <set>

#include "config/additions/addition_reader.h"
#include "config/base/value_text.h"
#include "config/settings/yaml_text.h"
#include "config/yaml/yaml_reader.h"
#include "rt/base/pose.h"
#include "tools/lib/registration/rigid_fit.h"

namespace hapticd::tools {
namespace {

using base::Error;
using config::YamlMember;
using config::YamlNode;

constexpr std::size_t kMaxTextLength = std::size_t{1} << 20;
constexpr std::size_t kMaxErrors = 20;
constexpr double kFarthest_m = 20;  // no haptic workspace and no depth camera reaches farther
constexpr const char* kForm = "write each landmark as `- {name: tip, position_m: [0.01, 0.02, 0.03]}`";

/// Gathers the landmarks of a list and what is wrong with it.
class Reader {
 public:
  explicit Reader(const std::string& file) : file_(file) {}

  void take(const YamlNode& list) {
    if (list.type != YamlNode::Type::list) return report(list.line, "landmarks is not a list", kForm);
    for (const YamlNode& item : list.items) takeItem(item);
  }

  void report(int line, std::string what, std::string remedy) {
    if (errors_.size() >= kMaxErrors) return;
    errors_.push_back(
        {line > 0 ? fmt::format("{}:{}", file_, line) : file_, std::move(what), std::move(remedy)});
  }

  FileOf<PlacedLandmark> finish() && {
    if (!errors_.empty()) return std::unexpected(std::move(errors_));
    return std::move(landmarks_);
  }

 private:
  void takeItem(const YamlNode& item) {
    if (item.type != YamlNode::Type::map) return report(item.line, "a landmark is not a mapping", kForm);
    for (const YamlMember& member : item.members) {
      if (member.name == "name" || member.name == "position_m") continue;
      report(member.line, fmt::format("there is no member {}", base::inQuotes(member.name)), kForm);
    }
    const YamlMember* const name = item.find("name");
    const YamlMember* const position = item.find("position_m");
    if (name == nullptr || name->value.type != YamlNode::Type::scalar || name->value.text.empty())
      return report(item.line, "a landmark has no name", kForm);
    const std::string quoted = base::inQuotes(name->value.text);
    if (!names_.insert(name->value.text).second)
      return report(item.line, fmt::format("{} is there twice", quoted), "rename one of the two");
    const auto place = position != nullptr ? vectorIn(position->value) : std::nullopt;
    if (!place) {
      report(item.line,
             fmt::format("{}: position_m is not a list of three numbers within -{}..{} m", quoted,
                         kFarthest_m, kFarthest_m),
             kForm);
    }
    landmarks_.push_back({name->value.text, place.value_or(rt::Vec3())});
  }

  static std::optional<rt::Vec3> vectorIn(const YamlNode& node) {
    if (node.type != YamlNode::Type::list || node.items.size() != 3) return std::nullopt;
    double numbers[3] = {};
    for (std::size_t i = 0; i < 3; ++i) {
      const YamlNode& item = node.items[i];
      if (item.type != YamlNode::Type::scalar || item.quoted) return std::nullopt;
      const auto number = base::yamlNumberFrom(item.text);
      // written so that a value that is not a number is out of range
      if (!number || !(std::abs(*number) <= kFarthest_m)) return std::nullopt;
      numbers[i] = *number;
    }
    return rt::Vec3{numbers[0], numbers[1], numbers[2]};
  }

  const std::string& file_;
  std::vector<PlacedLandmark> landmarks_;
  std::set<std::string> names_;
  std::vector<Error> errors_;
};

}  // namespace

FileOf<PlacedLandmark> landmarksFromText(std::string_view text, const std::string& file) {
  Reader reader(file);
  if (text.size() > kMaxTextLength) {
    reader.report(0, "is longer than 1 MiB", "remove what is not a landmark");
    return std::move(reader).finish();
  }
  const config::YamlFile yaml = config::readYaml(text);
  for (const config::YamlProblem& problem : yaml.problems)
    reader.report(problem.line, problem.what, problem.remedy);
  for (const config::YamlGroup& group : yaml.groups) {
    if (group.name == config::kLandmarkGroup || config::isAdditionGroup(group.name)) continue;
    reader.report(group.line, fmt::format("{} is not one of the lists", base::inQuotes(group.name)),
                  "the landmarks are below `landmarks:`");
  }
  const auto list = std::ranges::find(yaml.lists, config::kLandmarkGroup, &config::YamlList::name);
  if (list != yaml.lists.end()) {
    reader.take(list->node);
  } else if (yaml.problems.empty()) {
    reader.report(0, "has no list `landmarks:`", kForm);
  }
  return std::move(reader).finish();
}

std::string textOf(const std::vector<PlacedLandmark>& landmarks) {
  if (landmarks.empty()) return "landmarks: []\n";
  std::string text = "landmarks:\n";
  for (const PlacedLandmark& landmark : landmarks) {
    text += fmt::format("  - name: {}\n    position_m: [{}, {}, {}]\n", config::quotedText(landmark.name),
                        base::numberText(landmark.position_m.x), base::numberText(landmark.position_m.y),
                        base::numberText(landmark.position_m.z));
  }
  return text;
}

base::Result<std::vector<PointPair>> pairsOf(const std::vector<PlacedLandmark>& model,
                                             const std::vector<PlacedLandmark>& measured) {
  std::map<std::string_view, const PlacedLandmark*> found;
  for (const PlacedLandmark& landmark : measured) found.emplace(landmark.name, &landmark);
  std::vector<PointPair> pairs;
  for (const PlacedLandmark& landmark : model) {
    const auto place = found.extract(landmark.name);
    if (place) pairs.push_back({landmark.name, landmark.position_m, place.mapped()->position_m});
  }
  if (!found.empty())
    return std::unexpected(Error{base::printable(found.begin()->first),
                                 "the model has no landmark of this name",
                                 "give it the name that it has in the model"});
  return pairs;
}

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using rt::FixtureKind;
using rt::Vec3;

constexpr double kDegPerRad = 180 / std::numbers::pi;

Vector3d eigenOf(const Vec3& v) {
  return {v.x, v.y, v.z};
}
Vec3 vec3Of(const Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}
Matrix3d matrixOf(const rt::PoseParameters& pose) {
  const std::array<double, 9> rows = rt::rotationOf(pose);
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rows.data());
}

/// T_world_model.
class Motion {
 public:
  explicit Motion(const rt::PoseParameters& pose)
      : rotation_(matrixOf(pose)), position_m_(eigenOf(pose.position_m)) {}

  Vec3 place(const Vec3& p) const { return vec3Of(rotation_ * eigenOf(p) + position_m_); }
  Vec3 direction(const Vec3& v) const { return vec3Of(rotation_ * eigenOf(v)); }
  Vec3 angles(const Vec3& angles_deg) const {
    const rt::PoseParameters own{
        {}, angles_deg.x / kDegPerRad, angles_deg.y / kDegPerRad, angles_deg.z / kDegPerRad};
    const Matrix3d rotation = rotation_ * matrixOf(own);
    const rt::PoseParameters turned = poseOf(std::span<const double, 9>(rotation.data(), 9), {});
    return {kDegPerRad * turned.roll_rad, kDegPerRad * turned.pitch_rad, kDegPerRad * turned.yaw_rad};
  }

 private:
  Matrix3d rotation_;
  Vector3d position_m_;
};

// A member that a kind does not use keeps its default, as config::FixtureSettings has it.

void move(config::FixtureSettings& fixture, const Motion& T_world_model) {
  if (fixture.kind == FixtureKind::standoff) return;
  for (Vec3& point : fixture.points_m) point = T_world_model.place(point);
  if (fixture.kind == FixtureKind::path) return;
  fixture.position_m = T_world_model.place(fixture.position_m);
  if (fixture.kind == FixtureKind::plane) fixture.normal = T_world_model.direction(fixture.normal);
  if (fixture.kind == FixtureKind::cone) fixture.axis = T_world_model.direction(fixture.axis);
  if (fixture.kind == FixtureKind::capsule) fixture.end_m = T_world_model.place(fixture.end_m);
  if (fixture.kind == FixtureKind::box || fixture.kind == FixtureKind::solid)
    fixture.rotation_deg = T_world_model.angles(fixture.rotation_deg);
}

void move(config::RegionSettings& region, const Motion& T_world_model) {
  region.position_m = T_world_model.place(region.position_m);
  if (region.shape == rt::ShapeKind::capsule) region.end_m = T_world_model.place(region.end_m);
  if (region.shape == rt::ShapeKind::box) region.rotation_deg = T_world_model.angles(region.rotation_deg);
}

Error notOfTheModel(const char* noun, const std::string& name, const char* what) {
  return {fmt::format("{} {}", noun, name), fmt::format("{}, not in that of the model", what),
          "take it out of the file, and add it by itself"};
}

std::string_view wordOfFrame(const config::FixtureSettings& fixture) {
  return fixture.frame;
}
std::string_view wordOfFrame(const config::RegionSettings& region) {
  return rt::wordOf(region.frame);
}

template <typename Item>
std::optional<Error> frameProblem(const char* noun, const Item& item) {
  if (wordOfFrame(item) == "world") return std::nullopt;
  const std::string what = wordOfFrame(item) == "camera"
                               ? "it is in the frame of the camera"
                               : fmt::format("it is in the frame {}, which moves", wordOfFrame(item));
  return notOfTheModel(noun, item.name, what.c_str());
}

Vec3 meanOf(std::span<const Vec3> points_m) {
  Vec3 sum;
  for (const Vec3& point : points_m) sum += point;
  return (1.0 / static_cast<double>(points_m.size())) * sum;
}

}  // namespace

base::Result<config::SceneAdditions> movedToWorld(const config::SceneAdditions& of_model,
                                                  const rt::PoseParameters& T_world_model) {
  const Motion motion(T_world_model);
  config::SceneAdditions moved = of_model;
  for (config::FixtureSettings& fixture : moved.fixtures) {
    if (auto problem = frameProblem("fixture", fixture)) return std::unexpected(std::move(*problem));
    move(fixture, motion);
  }
  for (config::RegionSettings& region : moved.regions) {
    if (region.place == rt::TissuePlace::label)
      return std::unexpected(notOfTheModel("region", region.name, "it is in the image of the camera"));
    if (auto problem = frameProblem("region", region)) return std::unexpected(std::move(*problem));
    move(region, motion);
  }
  return moved;
}

std::optional<Vec3> centreOf(const config::SceneAdditions& additions) {
  std::vector<Vec3> centres_m;
  for (const config::FixtureSettings& fixture : additions.fixtures) {
    if (fixture.kind == FixtureKind::standoff) continue;
    if (fixture.kind == FixtureKind::path) {
      centres_m.push_back(meanOf(fixture.points_m));
    } else if (fixture.kind == FixtureKind::capsule) {
      centres_m.push_back(0.5 * (fixture.position_m + fixture.end_m));
    } else {
      centres_m.push_back(fixture.position_m);
    }
  }
  for (const config::RegionSettings& region : additions.regions) {
    if (region.place == rt::TissuePlace::label) continue;
    const bool capsule = region.shape == rt::ShapeKind::capsule;
    centres_m.push_back(capsule ? 0.5 * (region.position_m + region.end_m) : region.position_m);
  }
  if (centres_m.empty()) return std::nullopt;
  return meanOf(centres_m);
}

double expectedTargetError_m(std::span<const PointPair> pairs, double rms_m, const Vec3& target_m_in_world) {
  const auto count = static_cast<double>(pairs.size());
  Vector3d centroid = Vector3d::Zero();
  for (const PointPair& pair : pairs) centroid += eigenOf(pair.world_m) / count;
  Matrix3d covariance = Matrix3d::Zero();
  for (const PointPair& pair : pairs) {
    const Vector3d off = eigenOf(pair.world_m) - centroid;
    covariance += off * off.transpose() / count;
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3d> principal(covariance);
  const Vector3d along = principal.eigenvectors().transpose() * (eigenOf(target_m_in_world) - centroid);
  double sum = 0;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const double target_squared = along.squaredNorm() - along[k] * along[k];
    const double landmarks_squared = principal.eigenvalues().sum() - principal.eigenvalues()[k];
    sum += target_squared / landmarks_squared;
  }
  const double landmark_error_squared = rms_m * rms_m * count / (count - 2);
  return std::sqrt(landmark_error_squared / count * (1 + sum / 3));
}

}  // namespace hapticd::tools
