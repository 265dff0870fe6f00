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
/// Of JSON: the parser's tree takes up to a hundred bytes for each value, and other code descends into it.
constexpr std::size_t kMaxValues = 2'000'000;
constexpr std::size_t kMaxNesting = 64;
/// Of a line of .fcsv; those behind them have no meaning.
constexpr std::size_t kMaxFields = 64;
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

constexpr std::string_view kStatuses[] = {"undefined", "preview", "defined", "missing"};  // 0 to 3 in .fcsv

/// Warns of points that a person has not placed, or no longer.
void warnOfUnplaced(const Markup& markup, const std::string& where, std::vector<std::string>& warnings) {
  const std::size_t count = markup.unplaced.size();
  if (count == 0) return;
  constexpr std::size_t kMostNames = 20;
  std::vector<std::string> names;
  for (std::size_t i = 0; i < std::min(count, kMostNames); ++i)
    names.push_back(base::inQuotes(markup.unplaced[i]));
  warnings.push_back(fmt::format("{}: {} of {} control points have no position and are left out: {}{}", where,
                                 count, count + markup.points.size(), fmt::join(names, ", "),
                                 count > kMostNames ? ", ..." : ""));
}

/// The label of a point, or its name by its place.
std::string labelOf(std::string_view label, std::size_t number) {
  return label.empty() ? fmt::format("point {}", number) : std::string(label);
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
      const std::string status =
          point.contains("positionStatus") ? textAt(point, "positionStatus") : "defined";
      if (std::ranges::find(kStatuses, status) == std::end(kStatuses))
        return fault(where_, fmt::format("the positionStatus of control point {} is {} (allowed: {})", number,
                                         base::inQuotes(status), fmt::join(kStatuses, ", ")));
      std::string label = labelOf(textAt(point, "label"), number);
      if (place == point.end() || place->is_null() || status != "defined") {
        markup_.unplaced.push_back(std::move(label));
        continue;
      }
      const auto numbers = numbersOf<3>(*place);
      if (!numbers)
        return fault(where_,
                     fmt::format("the position of control point {} is not an array of 3 numbers", number));
      markup_.points.push_back({std::move(label), position(*numbers)});
      if (auto done = checkPlace(markup_.points.back().position_m); !done) return done;
    }
    warnOfUnplaced(markup_, where_, warnings_);
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
    if (const auto base = baseOfPlane()) {
      if (!direction_of_normal) direction_of_normal = unitOf(inBase(*base, 2));
      if (!place_m) place_m = (*base)[3] + metres_ * inBase(*base, 3);
    }
    if (!place_m && !markup_.points.empty()) place_m = markup_.points.front().position_m;
    if (!place_m || !direction_of_normal)
      return fault(where_, "the plane has no center or no normal", "place the plane completely, and save it");
    markup_.plane = MarkupPlane{*place_m, *direction_of_normal};
    return checkPlace(*place_m);
  }

  std::optional<std::array<double, 16>> matrix(const char* key) const {
    const auto found = json_.find(key);
    return found == json_.end() ? std::nullopt : numbersOf<16>(*found);
  }

  /// The axes and the origin of the coordinates in which the plane is the plane of x and y, unless it is
  /// turned in them: those that the file states, else those of its three points.
  std::optional<std::array<rt::Vec3, 4>> baseOfPlane() const {
    if (const auto m = matrix("baseToNode"))
      return std::array{direction((*m)[0], (*m)[4], (*m)[8]), direction((*m)[1], (*m)[5], (*m)[9]),
                        direction((*m)[2], (*m)[6], (*m)[10]), position({(*m)[3], (*m)[7], (*m)[11]})};
    const auto& p = markup_.points;
    if (p.size() < 3) return std::nullopt;
    constexpr double kMillimetresPerMetre = 1e3;
    const auto x = unitOf(kMillimetresPerMetre * (p[1].position_m - p[0].position_m));
    const auto z =
        x ? unitOf(cross(*x, kMillimetresPerMetre * (p[2].position_m - p[0].position_m))) : std::nullopt;
    if (!z) return std::nullopt;
    return std::array{*x, cross(*z, *x), *z, p[0].position_m};
  }

  /// A column of objectToBase, which turns the plane in its base, as a vector in LPS. 3D Slicer turns each of
  /// the two matrices from LPS to RAS, the coordinates of the base therefore twice, and then multiplies them.
  rt::Vec3 inBase(const std::array<rt::Vec3, 4>& base, std::size_t column) const {
    const auto object = matrix("objectToBase");
    if (!object) return column < 3 ? base[column] : rt::Vec3{};
    const rt::Vec3 turned = direction((*object)[column], (*object)[4 + column], (*object)[8 + column]);
    const rt::Vec3 in_ras{-turned.x, -turned.y, turned.z};
    return in_ras.x * base[0] + in_ras.y * base[1] + in_ras.z * base[2];
  }

  const Json& json_;
  std::string where_;
  std::vector<std::string>& warnings_;
  Frame frame_ = Frame::lps;
  double metres_ = kMetresPerMillimetre;
  Markup markup_;
};

/// Refuses what would take much memory or a deep stack, before the parser makes a tree of it.
base::Result<void> checkStructure(std::string_view bytes, const std::string& name) {
  std::size_t nesting = 0, values = 0;
  bool in_text = false;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const char c = bytes[i];
    if (in_text) {
      if (c == '\\') ++i;
      in_text = c != '"';
      continue;
    }
    in_text = c == '"';
    if (c == '[' || c == '{') ++nesting;
    if ((c == ']' || c == '}') && nesting > 0) --nesting;
    if (c == '[' || c == '{' || c == ',') ++values;
    if (nesting > kMaxNesting || values > kMaxValues)
      return refused(fmt::format("{}: byte {}", name, i + 1),
                     fmt::format("more than {} values, or nested more than {} deep", kMaxValues, kMaxNesting),
                     "save fewer markups in a file");
  }
  return {};
}

base::Result<MarkupFile> readJson(std::string_view bytes, const std::string& name) {
  if (auto checked = checkStructure(bytes, name); !checked) return std::unexpected(checked.error());
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

/// The first kMaxFields fields of a line. As 3D Slicer reads it: quotes at the beginning of a field enclose
/// what may contain commas, two quotes there stand for one, and elsewhere a quote is itself.
std::vector<std::string> csvFields(std::string_view line) {
  std::vector<std::string> fields(1);
  bool in_quotes = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (in_quotes && line.substr(i, 2) == "\"\"") {
      fields.back() += line[++i];
    } else if (c == '"' && (in_quotes || fields.back().empty())) {
      in_quotes = !in_quotes;
    } else if (c == ',' && !in_quotes) {
      if (fields.size() == kMaxFields) break;
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
    warnOfUnplaced(markup, name_, file.warnings);
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
    const std::size_t row = markup.points.size() + markup.unplaced.size() + 1;
    if (row > kMaxPoints) return fault(here(), fmt::format("more than {} points", kMaxPoints));
    const auto at = [&](std::size_t place) {
      return place < fields.size() ? trimmed(fields[place]) : std::string_view();
    };
    const auto field = [&](std::string_view column) {
      const auto place = static_cast<std::size_t>(std::ranges::find(columns_, column) - columns_.begin());
      return place < columns_.size() ? at(place) : std::string_view();
    };
    std::string label = labelOf(field("label"), row);
    // The position status, which no header names.
    constexpr std::size_t kStatus = 14;
    const std::string_view status = columns_.size() <= kStatus ? at(kStatus) : "";
    if (status == "0" || status == "1" || status == "3") {
      markup.unplaced.push_back(std::move(label));
      return {};
    }
    if (!status.empty() && status != "2")
      return fault(here(), fmt::format("the position status, field {}, is {} (allowed: 0 to 3)", kStatus,
                                       base::inQuotes(status)));
    std::array<double, 3> numbers{};
    constexpr std::array<std::string_view, 3> kAxes{"x", "y", "z"};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto number = coordinateFrom(field(kAxes[axis]));
      if (!number || std::abs(*number) > kFarthest_mm)
        return fault(here(), fmt::format("{} is {} (allowed: a number in -{}..{})", kAxes[axis],
                                         base::inQuotes(field(kAxes[axis])), kFarthest_mm, kFarthest_mm));
      numbers[axis] = *number;
    }
    markup.points.push_back(
        {std::move(label), kMetresPerMillimetre * rt::Vec3{numbers[0], numbers[1], numbers[2]}});
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
