// SPDX-License-Identifier: Apache-2.0
#include "tools/lib/solids/files/markups_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "config/base/value_text.h"
#include "tools/lib/solids/files/source_file.h"

namespace hapticd::solids {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kMaxBytes = 16 << 20;
constexpr std::size_t kMaxPoints = 100'000;
constexpr double kFarthest_mm = 1e5;
constexpr const char* kSaveAgain = "save the markups again in 3D Slicer";

struct KindName {
  MarkupKind kind;
  std::string_view name;
};
constexpr KindName kKinds[] = {{MarkupKind::fiducial, "Fiducial"},
                               {MarkupKind::line, "Line"},
                               {MarkupKind::angle, "Angle"},
                               {MarkupKind::curve, "Curve"},
                               {MarkupKind::plane, "Plane"},
                               {MarkupKind::closed_curve, "ClosedCurve"},
                               {MarkupKind::roi, "ROI"}};

/// A fault within a markup; the caller adds the file.
using Fault = std::unexpected<base::Error>;
Fault fault(const std::string& where, std::string what, std::string remedy = kSaveAgain) {
  return refused(where, std::move(what), std::move(remedy));
}

template <std::size_t count>
std::optional<std::array<double, count>> numbersOf(const Json& json) {
  if (!json.is_array() || json.size() != count) return std::nullopt;
  std::array<double, count> numbers{};
  for (std::size_t i = 0; i < count; ++i) {
    if (!json[i].is_number()) return std::nullopt;
    numbers[i] = json[i].get<double>();
    if (!(std::abs(numbers[i]) <= kFarthest_mm * 1e3)) return std::nullopt;  // micrometres
  }
  return numbers;
}

std::string textAt(const Json& json, const char* key) {
  const auto found = json.find(key);
  return found != json.end() && found->is_string() ? found->get<std::string>() : "";
}

std::optional<rt::Vec3> unitOf(const rt::Vec3& vector) {
  const double length = norm(vector);
  if (!(length > 1e-6)) return std::nullopt;
  return (1 / length) * vector;
}

/// One element of "markups".
class MarkupReader {
 public:
  MarkupReader(const Json& json, std::string where, std::vector<std::string>& warnings)
      : json_(json), where_(std::move(where)), warnings_(warnings) {}

  base::Result<Markup> read() {
    if (!json_.is_object()) return fault(where_, "is not an object");
    const std::string type = textAt(json_, "type");
    const auto* kind = std::ranges::find(kKinds, std::string_view(type), &KindName::name);
    if (kind == std::end(kKinds))
      return fault(
          where_,
          fmt::format("the type is {} (allowed: Fiducial, Line, Angle, Curve, ClosedCurve, Plane, ROI)",
                      base::inQuotes(type)),
          "remove this markup from the file");
    markup_.kind = kind->kind;
    markup_.name = textAt(json_, "name");
    if (auto done = takeFrame(); !done) return std::unexpected(done.error());
    if (auto done = takePoints(); !done) return std::unexpected(done.error());
    if (markup_.kind == MarkupKind::roi) {
      if (auto done = takeBox(); !done) return std::unexpected(done.error());
    }
    if (markup_.kind == MarkupKind::plane) {
      if (auto done = takePlane(); !done) return std::unexpected(done.error());
    }
    return std::move(markup_);
  }

 private:
  rt::Vec3 direction(double x, double y, double z) const { return inLps({x, y, z}, frame_); }
  rt::Vec3 position(const std::array<double, 3>& numbers) const {
    return metres_ * direction(numbers[0], numbers[1], numbers[2]);
  }

  base::Result<void> takeFrame() {
    const auto system = json_.find("coordinateSystem");
    if (system != json_.end()) {
      const auto frame = system->is_string() ? frameOf(system->get<std::string>()) : std::nullopt;
      if (!frame)
        return fault(
            where_, fmt::format("coordinateSystem is {} (allowed: LPS, RAS)",
                                base::inQuotes(system->dump(-1, ' ', true, Json::error_handler_t::replace))));
      frame_ = *frame;
    }
    const auto units = json_.find("coordinateUnits");
    if (units == json_.end()) return {};
    const Json& word = units->is_array() && !units->empty() ? units->front() : *units;
    if (word == "mm") return {};
    if (word != "um")
      return fault(where_,
                   fmt::format("coordinateUnits is {} (allowed: mm, um)",
                               base::inQuotes(word.dump(-1, ' ', true, Json::error_handler_t::replace))));
    metres_ = 1e-6;
    return {};
  }

  base::Result<void> takePoints() {
    const auto points = json_.find("controlPoints");
    if (points == json_.end()) return {};
    if (!points->is_array() || points->size() > kMaxPoints)
      return fault(where_, fmt::format("controlPoints is not an array of at most {} points", kMaxPoints));
    std::size_t number = 0;
    for (const Json& point : *points) {
      ++number;
      if (!point.is_object()) return fault(where_, fmt::format("control point {} is not an object", number));
      const auto place = point.find("position");
      const std::string status = textAt(point, "positionStatus");
      if (place == point.end() || place->is_null() || (!status.empty() && status != "defined")) continue;
      const auto numbers = numbersOf<3>(*place);
      if (!numbers)
        return fault(where_,
                     fmt::format("the position of control point {} is not an array of 3 numbers", number));
      std::string label = textAt(point, "label");
      if (label.empty()) label = fmt::format("point {}", number);
      markup_.points.push_back({std::move(label), textAt(point, "description"), position(*numbers)});
      if (auto done = checkPlace(markup_.points.back().position_m); !done) return done;
    }
    if (number > markup_.points.size())
      warnings_.push_back(fmt::format("{}: {} of {} control points have no position and are left out", where_,
                                      number - markup_.points.size(), number));
    return {};
  }

  base::Result<void> checkPlace(const rt::Vec3& place_m) const {
    if (norm(place_m) <= kFarthest_mm * kMetresPerMillimetre) return {};
    return fault(where_,
                 fmt::format("a position is {} (allowed: at most {} mm from the origin)",
                             millimetreText(place_m), kFarthest_mm),
                 "check the unit of the file");
  }

  /// The columns of "orientation", the unit matrix if it is missing.
  base::Result<std::array<rt::Vec3, 3>> axes() const {
    const auto orientation = json_.find("orientation");
    std::array<double, 9> m{1, 0, 0, 0, 1, 0, 0, 0, 1};
    if (orientation != json_.end()) {
      const auto numbers = numbersOf<9>(*orientation);
      if (!numbers) return fault(where_, "orientation is not an array of 9 numbers");
      m = *numbers;
    }
    const std::array<rt::Vec3, 3> axes{direction(m[0], m[3], m[6]), direction(m[1], m[4], m[7]),
                                       direction(m[2], m[5], m[8])};
    constexpr double kTolerance = 1e-3;  // of numbers with few digits
    for (std::size_t i = 0; i < 3; ++i) {
      const bool is_orthogonal = std::abs(norm(axes[i]) - 1) < kTolerance &&
                                 norm(cross(axes[i], axes[(i + 1) % 3]) - axes[(i + 2) % 3]) < 2 * kTolerance;
      if (!is_orthogonal) return fault(where_, "orientation is not a rotation matrix");
    }
    return axes;
  }

  base::Result<void> takeBox() {
    const auto centre = json_.find("center"), size = json_.find("size");
    const auto centre_numbers = centre == json_.end() ? std::nullopt : numbersOf<3>(*centre);
    const auto size_numbers = size == json_.end() ? std::nullopt : numbersOf<3>(*size);
    if (!centre_numbers || !size_numbers)
      return fault(where_, "the ROI has no center and size of 3 numbers each");
    for (const double length : *size_numbers)
      if (!(length > 0))
        return fault(where_, fmt::format("a size of the ROI is {} (allowed: above 0)", length),
                     "give the ROI a volume");
    const auto box_axes = axes();
    if (!box_axes) return std::unexpected(box_axes.error());
    const auto& s = *size_numbers;
    markup_.box = MarkupBox{position(*centre_numbers), *box_axes, metres_ * rt::Vec3{s[0], s[1], s[2]}};
    const auto inside_out = json_.find("insideOut");
    if (inside_out != json_.end() && *inside_out == true)
      warnings_.push_back(fmt::format("{}: the ROI is inside out, which is ignored", where_));
    return checkPlace(markup_.box->centre_m);
  }

  /// A point on the plane and its normal, as far as the file states them directly.
  base::Result<void> takePlane() {
    const auto centre = json_.find("center"), normal = json_.find("normal");
    std::optional<rt::Vec3> place_m, direction_of_normal;
    if (const auto numbers = centre == json_.end() ? std::nullopt : numbersOf<3>(*centre))
      place_m = position(*numbers);
    if (const auto numbers = normal == json_.end() ? std::nullopt : numbersOf<3>(*normal))
      direction_of_normal = unitOf(direction((*numbers)[0], (*numbers)[1], (*numbers)[2]));
    const auto matrix = [&](const char* key) {
      const auto found = json_.find(key);
      return found == json_.end() ? std::nullopt : numbersOf<16>(*found);
    };
    // objectToBase turns the plane within the coordinates of its base, which is nearly always the unit matrix
    const auto base = matrix("baseToNode"), object = matrix("objectToBase");
    if (base) {
      const auto& b = *base;
      const std::array<double, 16> unit{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
      const auto& o = object ? *object : unit;
      const auto entry = [&](std::size_t row, std::size_t column) {
        double sum = column == 3 ? b[4 * row + 3] : 0;
        for (std::size_t k = 0; k < 3; ++k) sum += b[4 * row + k] * o[4 * k + column];
        return sum;
      };
      if (!direction_of_normal)
        direction_of_normal = unitOf(direction(entry(0, 2), entry(1, 2), entry(2, 2)));
      if (!place_m) place_m = position({entry(0, 3), entry(1, 3), entry(2, 3)});
    }
    if (!place_m && !markup_.points.empty()) place_m = markup_.points.front().position_m;
    const auto& p = markup_.points;
    if (!direction_of_normal && p.size() >= 3)
      direction_of_normal =
          unitOf(1e6 * cross(p[1].position_m - p[0].position_m, p[2].position_m - p[0].position_m));
    if (!place_m || !direction_of_normal)
      return fault(where_, "the plane has no center or no normal", "place the plane completely, and save it");
    markup_.plane = MarkupPlane{*place_m, *direction_of_normal};
    return checkPlace(*place_m);
  }

  const Json& json_;
  std::string where_;
  std::vector<std::string>& warnings_;
  Frame frame_ = Frame::lps;
  double metres_ = kMetresPerMillimetre;
  Markup markup_;
};

base::Result<MarkupFile> readJson(std::string_view bytes, const std::string& name) {
  Json json;
  try {
    json = Json::parse(bytes);
  } catch (const Json::parse_error& error) {
    return refused(fmt::format("{}: byte {}", name, error.byte), "is not JSON",
                   "the file is truncated or damaged: save it again");
  } catch (const Json::exception&) {  // a number that is too large
    return refused(name, "contains a number that is too large", kSaveAgain);
  }
  const auto markups = json.is_object() ? json.find("markups") : json.end();
  if (!json.is_object() || markups == json.end() || !markups->is_array())
    return refused(name, "has no array 'markups'", "check that the file was saved as .mrk.json");
  MarkupFile file;
  const std::string schema = textAt(json, "@schema");
  if (schema.find("markups-schema-v1.0") == std::string::npos &&
      schema.find("markups-v1.0") == std::string::npos)
    file.warnings.push_back(
        fmt::format("{}: the schema is {} (known: markups-schema-v1.0.x)", name, base::inQuotes(schema)));
  std::size_t number = 0;
  for (const Json& element : *markups) {
    auto markup = MarkupReader(element, fmt::format("{}: markup {}", name, ++number), file.warnings).read();
    if (!markup) return std::unexpected(markup.error());
    file.markups.push_back(std::move(*markup));
  }
  return file;
}

/// The fields of a line; one in quotes may contain commas, and two quotes stand for one.
std::vector<std::string> csvFields(std::string_view line) {
  std::vector<std::string> fields(1);
  bool in_quotes = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (c == '"' && in_quotes && i + 1 < line.size() && line[i + 1] == '"') {
      fields.back() += '"';
      ++i;
    } else if (c == '"') {
      in_quotes = !in_quotes;
    } else if (c == ',' && !in_quotes) {
      fields.emplace_back();
    } else {
      fields.back() += c;
    }
  }
  return fields;
}

class FcsvFile {
 public:
  FcsvFile(std::string_view bytes, const std::string& name) : lines_(bytes), name_(name) {}

  base::Result<MarkupFile> read() {
    Markup markup;
    while (const auto line = lines_.nextLine()) {
      base::Result<void> done;
      if (line->starts_with('#'))
        done = takeComment(line->substr(1));
      else if (!trimmed(*line).empty())
        done = takePoint(*line, markup);
      if (!done) return std::unexpected(done.error());
    }
    if (!frame_)
      return fault(fmt::format("{}:1", name_), "has no line '# CoordinateSystem = LPS'",
                   "add it, with LPS or RAS; files of 3D Slicer before 4.11 are RAS");
    for (MarkupPoint& point : markup.points) point.position_m = inLps(point.position_m, *frame_);
    MarkupFile file;
    file.markups.push_back(std::move(markup));
    return file;
  }

 private:
  std::string here() const { return fmt::format("{}:{}", name_, lines_.line()); }

  base::Result<void> takeComment(std::string_view comment) {
    const std::size_t equals = comment.find('=');
    if (equals == std::string_view::npos) return {};
    const std::string_view key = trimmed(comment.substr(0, equals)),
                           value = trimmed(comment.substr(equals + 1));
    if (key == "CoordinateSystem") {
      frame_ = value == "0" ? Frame::ras : value == "1" ? Frame::lps : frameOf(value);
      if (!frame_)
        return fault(here(), fmt::format("CoordinateSystem is {} (allowed: LPS, RAS, 0 for RAS, 1 for LPS)",
                                         base::inQuotes(value)));
    } else if (key == "columns") {
      columns_ = csvFields(value);
    }
    return {};
  }

  base::Result<void> takePoint(std::string_view line, Markup& markup) {
    const std::vector<std::string> fields = csvFields(line);
    if (markup.points.size() >= kMaxPoints)
      return fault(here(), fmt::format("more than {} points", kMaxPoints));
    const auto field = [&](std::string_view column) -> std::string_view {
      const auto place = static_cast<std::size_t>(std::ranges::find(columns_, column) - columns_.begin());
      return place < columns_.size() && place < fields.size() ? trimmed(fields[place]) : std::string_view();
    };
    std::array<double, 3> numbers{};
    constexpr std::array<std::string_view, 3> kAxes{"x", "y", "z"};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto number = coordinateFrom(field(kAxes[axis]));
      if (!number || std::abs(*number) > kFarthest_mm)
        return fault(here(), fmt::format("{} is {} (allowed: a number in -{}..{})", kAxes[axis],
                                         base::inQuotes(field(kAxes[axis])), kFarthest_mm, kFarthest_mm));
      numbers[axis] = *number;
    }
    std::string label(field("label"));
    if (label.empty()) label = fmt::format("point {}", markup.points.size() + 1);
    markup.points.push_back({std::move(label), std::string(field("desc")),
                             kMetresPerMillimetre * rt::Vec3{numbers[0], numbers[1], numbers[2]}});
    return {};
  }

  TextCursor lines_;
  const std::string& name_;
  std::optional<Frame> frame_;
  std::vector<std::string> columns_{"id", "x",   "y",   "z",    "ow",    "ox",  "oy",
                                    "oz", "vis", "sel", "lock", "label", "desc"};
};

}  // namespace

std::string_view textOf(MarkupKind kind) {
  return std::ranges::find(kKinds, kind, &KindName::kind)->name;
}

base::Result<MarkupFile> markupsFrom(std::string_view bytes, const std::string& name) {
  const std::string lower = lowerCase(name);
  if (bytes.size() > kMaxBytes)
    return refused(name, fmt::format("{} bytes (allowed: at most {})", bytes.size(), kMaxBytes),
                   "save fewer markups in a file");
  bytes = base::withoutByteOrderMark(bytes);
  if (lower.ends_with(".json")) return readJson(bytes, name);
  if (lower.ends_with(".fcsv")) return FcsvFile(bytes, name).read();
  return refused(name, "the ending is not that of markups (allowed: .mrk.json, .fcsv)",
                 "save the markups as .mrk.json");
}

base::Result<MarkupFile> readMarkups(const std::filesystem::path& file) {
  const auto bytes = contentOf(file, kMaxBytes);
  if (!bytes) return std::unexpected(bytes.error());
  return markupsFrom(*bytes, file.string());
}

}  // namespace hapticd::solids
