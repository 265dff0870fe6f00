// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/format/messages.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cstring>
#include <iterator>
#include <limits>
#include <type_traits>
#include <utility>

#include "config/base/value_text.h"
#include "daemon/trace/format/cdr.h"
#include "daemon/trace/format/records.h"
#include "rt/base/clock.h"
#include "rt/base/words.h"

namespace hapticd::trace {
namespace {

using Field = MessageLayout::Field;
using Form = MessageLayout::Form;

struct NumberType {
  std::string_view name;
  std::size_t bytes;
};
constexpr std::array<NumberType, 11> kNumberTypes{{{"bool", 1},
                                                   {"int8", 1},
                                                   {"uint8", 1},
                                                   {"int16", 2},
                                                   {"uint16", 2},
                                                   {"int32", 4},
                                                   {"uint32", 4},
                                                   {"float32", 4},
                                                   {"int64", 8},
                                                   {"uint64", 8},
                                                   {"float64", 8}}};

/// No array of a trace has more elements.
constexpr std::size_t kMaxNumbers = 4096;
/// Constants are values of one byte.
constexpr std::size_t kMaxConstants = 256;
/// No message of a trace has more fields, by far: each costs time in every message.
constexpr std::size_t kMaxFields = 1000;

std::optional<std::size_t> numberIn(std::string_view text) {
  std::size_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(number) : std::nullopt;
}

/// Parses e.g. "float64" or "float64[3]".
bool setNumbers(std::string_view type, Field& field) {
  const std::size_t bracket = type.find('[');
  const auto* const found = std::ranges::find(kNumberTypes, type.substr(0, bracket), &NumberType::name);
  if (found == kNumberTypes.end()) return false;
  field.bytes = found->bytes;
  if (bracket == std::string_view::npos) return true;
  if (!type.ends_with(']')) return false;
  const auto count = numberIn(type.substr(bracket + 1, type.size() - bracket - 2));
  field.count = count.value_or(0);
  return count && *count <= kMaxNumbers;
}

bool setForm(std::string_view type, Field& field) {
  if (type == "string") return field.form = Form::text, true;
  if (type == "uint8[]") return field.form = Form::bytes, true;
  if (type == "hapticd_msgs/NamedText[]") return field.form = Form::named_texts, true;
  if (type == "builtin_interfaces/Time") return field.form = Form::time, true;
  return setNumbers(type, field);
}

/// Adds "NAME=VALUE" to the constants of the following field.
bool addConstant(std::string_view text, std::vector<std::pair<std::uint8_t, std::string>>& constants) {
  const std::size_t equals = text.find('=');
  const auto value = numberIn(text.substr(equals + 1));
  if (!value || *value >= kMaxConstants) return false;
  constants.emplace_back(static_cast<std::uint8_t>(*value), text.substr(0, equals));
  return true;
}

void skipNumber(CdrReader& reader, std::size_t bytes) {
  switch (bytes) {
    case 1:
      reader.number<std::uint8_t>();
      return;
    case 2:
      reader.number<std::uint16_t>();
      return;
    case 4:
      reader.number<std::uint32_t>();
      return;
    default:
      reader.number<std::uint64_t>();
  }
}

void skip(CdrReader& reader, const Field& field) {
  switch (field.form) {
    case Form::numbers:
      for (std::size_t i = 0; i < field.count && reader.good(); ++i) skipNumber(reader, field.bytes);
      return;
    case Form::text:
      reader.text();
      return;
    case Form::bytes:
      reader.bytes();
      return;
    case Form::named_texts:
      for (auto left = reader.number<std::uint32_t>(); left > 0 && reader.good(); --left) {
        reader.text();
        reader.text();
      }
      return;
    case Form::time:
      reader.number<std::int32_t>();
      reader.number<std::uint32_t>();
  }
}

}  // namespace

std::expected<MessageLayout, std::string> MessageLayout::of(std::string_view schema) {
  MessageLayout layout;
  std::vector<std::pair<std::uint8_t, std::string>> constants;
  while (!schema.empty()) {
    const std::string_view line = schema.substr(0, schema.find('\n'));
    schema.remove_prefix(std::min(line.size() + 1, schema.size()));
    if (line.starts_with("===")) break;  // the definitions of nested types follow
    if (line.empty() || line.starts_with('#')) continue;
    const std::size_t blank = line.find(' ');
    const std::string_view name = blank == std::string_view::npos ? "" : line.substr(blank + 1);
    Field field{std::string(line.substr(0, blank)), std::string(name), {}};
    const bool constant = name.find('=') != std::string_view::npos;
    const bool known = constant ? addConstant(name, constants) : setForm(field.type, field);
    if (name.empty() || !known) {
      return std::unexpected(
          fmt::format("{} in its schema has a type that traces do not use", base::inQuotes(line)));
    }
    if (constant) continue;
    if (layout.fields_.size() >= kMaxFields) {
      return std::unexpected(fmt::format("its schema has more than {} fields", kMaxFields));
    }
    field.constants = std::exchange(constants, {});
    layout.fields_.push_back(std::move(field));
  }
  return layout;
}

std::optional<std::size_t> MessageLayout::find(std::string_view name) const {
  const auto found = std::ranges::find(fields_, name, &Field::name);
  if (found == fields_.end()) return std::nullopt;
  return static_cast<std::size_t>(found - fields_.begin());
}

bool MessageLayout::locate(std::string_view message, std::vector<std::size_t>& places) const {
  CdrReader reader(message);
  places.clear();
  for (const Field& field : fields_) {
    places.push_back(reader.place());
    skip(reader, field);
    if (!reader.good()) return false;
  }
  return reader.complete();
}

namespace {

using Pairs = std::vector<std::pair<std::string, std::string>>;
using CoreMemory = rt::HapticCore::Memory;

/// To be incremented when members of CoreMemory change their meaning but not their size.
constexpr std::uint32_t kMemoryLayout = 7;

constexpr std::string_view kTimeSchema = "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
constexpr std::string_view kNamedTextSchema = "MSG: hapticd_msgs/NamedText\nstring name\nstring value\n";

/// Explanation of a channel for readers who have only the file, as comments of its schema.
template <typename Record>
constexpr std::string_view kComment{};
template <>
constexpr std::string_view kComment<DepthRecord> =
    "# A raw depth frame. From magic to correlation_px: hapticd's DepthFrameHeader, whose version is\n"
    "# header_version.\n"
    "# Z is the depth along the optical axis in m. depth_law RECIPROCAL: 1/Z = c[0] raw + c[1]; LINEAR:\n"
    "# Z = c[0] raw + c[1], with c = depth_law_coefficients. The camera looks along -z, x is right, y is "
    "up:\n"
    "# x = Z (column - cx_px) / fx_px, y = -Z (row - cy_px) / fy_px. In the world a point is\n"
    "# rotation_world_camera (row by row) * (x, y, -Z) + position_m_in_world.\n"
    "# noise POLYNOMIAL: the standard deviation of Z in m is n[0] + n[1] Z + n[2] Z^2, with\n"
    "# n = noise_coefficients. standing_share of its variance is the same in each frame of a resting scene,\n"
    "# and over correlation_px pixels it is alike; correlation_px 0: n is what is usual, and not stated by\n"
    "# the camera. Times are CLOCK_MONOTONIC; exposure_ns 0: not known.\n"
    "# image, encoding PLAIN: height_px rows of stride_bytes, each pixel two bytes, the low one first.\n"
    "# ABOVE_ZSTD: a zstd frame of one to three bytes per pixel, row by row, width_px pixels per row:\n"
    "#   254: raw_no_measurement\n"
    "#   255: the raw value follows, two bytes, the low one first\n"
    "#   else: with p the last measured raw value above in the same column (0 if there is none), an even\n"
    "#   byte b says p + b / 2, an odd one p - (b + 1) / 2\n"
    "# What a row has behind its pixels is zero then. raw_crc32 is the CRC-32 of zlib of the rows as PLAIN\n"
    "# has them.\n";

std::string inCapitals(std::string_view text) {
  std::string capitals(text);
  std::ranges::transform(capitals, capitals.begin(),
                         [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return capitals;
}

template <typename Number>
constexpr std::string_view kNumberType{};
template <>
constexpr std::string_view kNumberType<bool> = "bool";
template <>
constexpr std::string_view kNumberType<std::uint8_t> = "uint8";
template <>
constexpr std::string_view kNumberType<std::uint16_t> = "uint16";
template <>
constexpr std::string_view kNumberType<std::uint32_t> = "uint32";
template <>
constexpr std::string_view kNumberType<std::uint64_t> = "uint64";
template <>
constexpr std::string_view kNumberType<std::int32_t> = "int32";
template <>
constexpr std::string_view kNumberType<std::int64_t> = "int64";
template <>
constexpr std::string_view kNumberType<double> = "float64";

/// Writes one line for each field that it visits.
struct SchemaOfFields {
  std::string text = "builtin_interfaces/Time stamp\n";
  bool named_texts = false;

  void line(std::string_view type, std::string_view name) {
    fmt::format_to(std::back_inserter(text), "{} {}\n", type, name);
  }
  template <CdrNumber Number>
  void operator()(std::string_view name, const Number&) {
    static_assert(!kNumberType<Number>.empty());
    line(kNumberType<Number>, name);
  }
  template <rt::Worded Enumeration>
  void operator()(std::string_view name, const Enumeration&) {
    int value = 0;
    for (const std::string_view word : rt::kWords<Enumeration>) {
      fmt::format_to(std::back_inserter(text), "uint8 {}_{}={}\n", inCapitals(name), inCapitals(word),
                     value++);
    }
    line("uint8", name);
  }
  template <CdrNumber Number, std::size_t kCount>
  void operator()(std::string_view name, const std::array<Number, kCount>&) {
    line(fmt::format("{}[{}]", kNumberType<Number>, kCount), name);
  }
  void operator()(std::string_view name, const rt::Vec3&) { line("float64[3]", name); }
  void operator()(std::string_view name, const std::string&) { line("string", name); }
  void operator()(std::string_view name, const ByteString&) { line("uint8[]", name); }
  void operator()(std::string_view name, const Pairs&) {
    line("hapticd_msgs/NamedText[]", name);
    named_texts = true;
  }
  void operator()(std::string_view name, const CoreMemory&) {
    line("uint32", fmt::format("{}_layout", name));
    line("uint8[]", name);
  }
};

struct EncodeFields {
  CdrWriter& to;

  void operator()(std::string_view, const CdrNumber auto& value) { to.number(value); }
  template <rt::Worded Enumeration>
  void operator()(std::string_view, const Enumeration& value) {
    to.number(static_cast<std::uint8_t>(value));
  }
  void operator()(std::string_view, const rt::Vec3& vector) {
    for (const double component : {vector.x, vector.y, vector.z}) to.number(component);
  }
  template <CdrNumber Number, std::size_t kCount>
  void operator()(std::string_view, const std::array<Number, kCount>& numbers) {
    for (const Number number : numbers) to.number(number);
  }
  void operator()(std::string_view, const std::string& text) { to.text(text); }
  void operator()(std::string_view, const ByteString& string) { to.bytes(string.bytes); }
  void operator()(std::string_view, const Pairs& pairs) {
    to.number(static_cast<std::uint32_t>(pairs.size()));
    for (const auto& [name, value] : pairs) {
      to.text(name);
      to.text(value);
    }
  }
  void operator()(std::string_view, const CoreMemory& memory) {
    to.number(kMemoryLayout);
    to.bytes({reinterpret_cast<const char*>(&memory), sizeof memory});
  }
};

struct DecodeFields {
  CdrReader& from;
  bool other_memory = false;  ///< the core memory has another layout and was not read

  template <CdrNumber Number>
  void operator()(std::string_view, Number& value) {
    value = from.number<Number>();
  }
  template <rt::Worded Enumeration>
  void operator()(std::string_view, Enumeration& value) {
    const auto number = from.number<std::uint8_t>();
    if (number >= rt::kWords<Enumeration>.size()) return from.refuse();
    value = static_cast<Enumeration>(number);
  }
  void operator()(std::string_view, rt::Vec3& vector) {
    for (double* const component : {&vector.x, &vector.y, &vector.z}) *component = from.number<double>();
  }
  template <CdrNumber Number, std::size_t kCount>
  void operator()(std::string_view, std::array<Number, kCount>& numbers) {
    for (Number& number : numbers) number = from.number<Number>();
  }
  void operator()(std::string_view, std::string& text) { text = from.text(); }
  void operator()(std::string_view, ByteString& string) { string.bytes = from.bytes(); }
  void operator()(std::string_view, Pairs& pairs) {
    constexpr std::size_t kMinPairBytes = 10;  // two lengths and two terminators
    const auto count = from.number<std::uint32_t>();
    if (count > from.left() / kMinPairBytes) return from.refuse();
    pairs.clear();
    for (std::uint32_t i = 0; i < count && from.good(); ++i) {
      std::string name(from.text());
      pairs.emplace_back(std::move(name), from.text());
    }
  }
  void operator()(std::string_view, CoreMemory& memory) {
    const bool same_layout = from.number<std::uint32_t>() == kMemoryLayout;
    const std::string_view bytes = from.bytes();
    other_memory = !same_layout || bytes.size() != sizeof memory;
    if (!other_memory) std::memcpy(&memory, bytes.data(), sizeof memory);
  }
};

/// Decodes a message of another version, field by field from its offset.
template <typename Sources>
struct DecodePlaces {
  CdrReader& from;
  const Sources& sources;
  const std::vector<std::size_t>& places;
  std::string& unknown_value;
  std::size_t next = 0;

  template <typename Value>
  void operator()(std::string_view name, Value& value) {
    const auto& [field, values] = sources[next++];
    if (!field) return makeUnknown(value);
    from.seek(places[*field]);
    if constexpr (rt::Worded<Value>) {
      const auto number = from.number<std::uint8_t>();
      if (number >= values.size() || !values[number]) {
        unknown_value = name;
        return from.refuse();
      }
      value = static_cast<Value>(*values[number]);
    } else {
      DecodeFields{from}(name, value);
    }
  }
  template <typename Value>
  void makeUnknown(Value& value) {
    constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
    if constexpr (std::is_same_v<Value, double>) {
      value = kUnknown;
    } else if constexpr (std::is_same_v<Value, rt::Vec3>) {
      value = {kUnknown, kUnknown, kUnknown};
    }
  }
};

/// Maps the values in `other` to the enumerators of `own`.
std::vector<std::optional<std::uint8_t>> valuesIn(const MessageLayout::Field& other,
                                                  const MessageLayout::Field& own) {
  constexpr std::size_t kValues = std::numeric_limits<std::uint8_t>::max() + 1;
  std::vector<std::optional<std::uint8_t>> values(other.constants.empty() ? 0 : kValues);
  for (const auto& [value, name] : other.constants) {
    const auto found = std::ranges::find(own.constants, name, [](const auto& known) { return known.second; });
    if (found != own.constants.end()) values[value] = found->first;
  }
  return values;
}

}  // namespace

template <typename Record>
std::string schemaOf() {
  SchemaOfFields schema;
  schema.text.insert(0, kComment<Record>);
  const Record record{};
  visitFields(record, schema);
  const std::string line(80, '=');
  schema.text += line + "\n" + std::string(kTimeSchema);
  if (schema.named_texts) schema.text += line + "\n" + std::string(kNamedTextSchema);
  return schema.text;
}

template <typename Record>
void encode(const Record& record, std::uint64_t realtime_ns, std::string& to) {
  CdrWriter writer(to);
  writer.number(static_cast<std::int32_t>(realtime_ns / rt::kNsPerSecond));
  writer.number(static_cast<std::uint32_t>(realtime_ns % rt::kNsPerSecond));
  visitFields(record, EncodeFields{writer});
}

template <typename Record>
MessageDecoder<Record>::MessageDecoder() = default;

template <typename Record>
std::expected<MessageDecoder<Record>, std::string> MessageDecoder<Record>::forSchema(
    std::string_view schema) {
  static const std::string own_schema = schemaOf<Record>();
  MessageDecoder decoder;
  if (schema == own_schema) return decoder;
  auto other = MessageLayout::of(schema);
  if (!other) return std::unexpected(other.error());
  const auto own = MessageLayout::of(own_schema);
  for (const MessageLayout::Field& field : own->fields()) {
    if (field.form == MessageLayout::Form::time) continue;
    const auto place = other->find(field.name);
    if (!place) decoder.missing_.push_back(field.name);
    if (place && other->fields()[*place].type != field.type) {
      return std::unexpected(fmt::format("'{}' is of the type {} there, not {}", field.name,
                                         other->fields()[*place].type, field.type));
    }
    decoder.sources_.push_back({place, place ? valuesIn(other->fields()[*place], field)
                                             : std::vector<std::optional<std::uint8_t>>{}});
  }
  decoder.other_ = std::move(*other);
  return decoder;
}

template <typename Record>
bool MessageDecoder<Record>::decode(std::string_view message, Record& record) {
  if (other_) return decodeOther(message, record);
  CdrReader reader(message);
  reader.number<std::int32_t>();  // the time, which is in the record as well
  reader.number<std::uint32_t>();
  DecodeFields fields{reader};
  visitFields(record, fields);
  if constexpr (std::is_same_v<Record, SnapshotRecord>) record.usable = !fields.other_memory;
  return reader.complete();
}

template <typename Record>
bool MessageDecoder<Record>::decodeOther(std::string_view message, Record& record) {
  unknown_value_.clear();
  if (!other_->locate(message, places_)) return false;
  if constexpr (std::is_same_v<Record, SnapshotRecord>) {
    record = {};
    record.usable = false;
    CdrReader reader(message);
    if (const auto time = other_->find("time_ns")) {
      reader.seek(places_[*time]);
      record.time_ns = reader.number<std::int64_t>();
    }
    return reader.good();
  } else {
    CdrReader reader(message);
    record = {};
    visitFields(record, DecodePlaces{reader, sources_, places_, unknown_value_});
    return reader.good();
  }
}

#define HAPTICD_MESSAGES_OF(Record)                                         \
  template std::string schemaOf<Record>();                                  \
  template void encode<Record>(const Record&, std::uint64_t, std::string&); \
  template class MessageDecoder<Record>
HAPTICD_MESSAGES_OF(rt::Tick);
HAPTICD_MESSAGES_OF(ModelRecord);
HAPTICD_MESSAGES_OF(DirectiveRecord);
HAPTICD_MESSAGES_OF(AdditionsRecord);
HAPTICD_MESSAGES_OF(PoseRecord);
HAPTICD_MESSAGES_OF(EventRecord);
HAPTICD_MESSAGES_OF(SnapshotRecord);
HAPTICD_MESSAGES_OF(DepthRecord);
#undef HAPTICD_MESSAGES_OF

}  // namespace hapticd::trace
