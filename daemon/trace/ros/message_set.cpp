// SPDX-License-Identifier: Apache-2.0
#include "daemon/trace/ros/message_set.h"

#include "daemon/trace/format/cdr.h"
#include "rt/base/clock.h"

namespace hapticd::trace::ros {
namespace {

struct Time {
  std::int64_t ns = 0;  ///< UTC
};

/// Appends one message member by member.
class Encoder {
 public:
  explicit Encoder(std::string& to) : to_(to) {}

  void operator()(const auto&... members) { (put(members), ...); }
  /// An array whose length is part of the type.
  void array(std::span<const double> numbers) {
    for (const double number : numbers) put(number);
  }
  /// A list of bytes.
  template <typename Number>
  void bytes(std::span<const Number> numbers) {
    to_.bytes({reinterpret_cast<const char*>(numbers.data()), numbers.size_bytes()});
  }
  void list(const auto& elements) {
    put(static_cast<std::uint32_t>(elements.size()));
    for (const auto& element : elements) put(element);
  }

 private:
  void put(CdrNumber auto number) { to_.number(number); }
  void put(std::string_view text) { to_.text(text); }
  /// Seconds since 1970 have 32 bits there, until 2038.
  void put(const Time& time) {
    const std::int64_t rest_ns = (time.ns % rt::kNsPerSecond + rt::kNsPerSecond) % rt::kNsPerSecond;
    put(static_cast<std::int32_t>((time.ns - rest_ns) / rt::kNsPerSecond));
    put(static_cast<std::uint32_t>(rest_ns));
  }
  void put(const Header& header) { (*this)(Time{header.time_ns}, header.frame); }
  void put(const rt::Vec3& v) { (*this)(v.x, v.y, v.z); }
  void put(const rt::Quaternion& q) { (*this)(q.x, q.y, q.z, q.w); }
  void put(const rt::RigidPose& pose) { (*this)(pose.position_m_in_world, pose.orientation); }
  void put(const Colour& colour) { (*this)(colour[0], colour[1], colour[2], colour[3]); }
  void put(const std::pair<std::string, std::string>& pair) { (*this)(pair.first, pair.second); }
  void put(const Diagnostic& part) {
    (*this)(static_cast<std::uint8_t>(part.level), part.name, part.message, part.hardware_id);
    list(part.values);
  }
  void put(const Gid& gid) {
    for (const std::uint8_t byte : gid) put(byte);
  }
  void put(const AnnouncedNode& node) {
    (*this)(node.name_space, node.name);
    list(node.readers);
    list(node.writers);
  }

  CdrWriter to_;
};

constexpr std::uint32_t kNone = 0;  ///< the length of an empty list

}  // namespace

void encodePose(const Header& header, const rt::RigidPose& pose, std::string& to) {
  Encoder{to}(header, pose);
}

void encodeVelocity(const Header& header, const rt::Vec3& linear_m_per_s, std::string& to) {
  Encoder{to}(header, linear_m_per_s, rt::Vec3{});
}

void encodeWrench(const Header& header, const rt::Vec3& force_n, const rt::Vec3& torque_n_m,
                  std::string& to) {
  Encoder{to}(header, force_n, torque_n_m);
}

void encodeState(const Header& header, const OperatingState& state, std::string& to) {
  Encoder{to}(header, state.state, state.is_homed, state.is_busy);
}

void encodeButtons(const Header& header, const HeldButtons& buttons, std::string& to) {
  Encoder encoder(to);
  encoder(header);
  encoder.list(buttons.axes);
  encoder.list(buttons.held);
}

void encodeDiagnostics(const Header& header, std::span<const Diagnostic> parts, std::string& to) {
  Encoder encoder(to);
  encoder(header);
  encoder.list(parts);
}

void encodeFrames(std::int64_t time_ns, std::span<const FixedFrame> frames, std::string& to) {
  Encoder encoder(to);
  encoder(static_cast<std::uint32_t>(frames.size()));
  for (const FixedFrame& frame : frames)
    encoder(Header{time_ns, frame.parent}, frame.name, frame.T_parent_frame);
}

void encodePoints(const Header& header, std::span<const float> xyz_m, std::string& to) {
  constexpr std::uint8_t kFloat32 = 7;
  constexpr std::uint32_t kNumberBytes = sizeof(float), kPointBytes = 3 * kNumberBytes, kEach = 1;
  const auto count = static_cast<std::uint32_t>(xyz_m.size() / 3);
  Encoder encoder(to);
  encoder(header, std::uint32_t{1}, count, std::uint32_t{3});  // height, width, and the number of fields
  encoder("x", 0 * kNumberBytes, kFloat32, kEach);
  encoder("y", 1 * kNumberBytes, kFloat32, kEach);
  encoder("z", 2 * kNumberBytes, kFloat32, kEach);
  encoder(false, kPointBytes, kPointBytes * count);  // little-endian
  encoder.bytes(xyz_m);
  encoder(true);  // dense: each point is one
}

void encodeDepthImage(const Header& header, const DepthImage& image, std::string& to) {
  constexpr std::uint32_t kPixelBytes = sizeof image.depth_mm[0];
  Encoder encoder(to);
  encoder(header, image.height_px, image.width_px, "16UC1");
  encoder(std::uint8_t{0}, kPixelBytes * image.width_px);  // little-endian
  encoder.bytes(std::span<const std::uint16_t>(image.depth_mm));
}

void encodeCameraInfo(const Header& header, const PinholeCamera& camera, std::string& to) {
  const auto& [width, height, fx, fy, cx, cy] = camera;
  Encoder encoder(to);
  encoder(header, height, width, "plumb_bob");
  encoder.list(std::array<double, 5>{});                                              // no distortion
  encoder.array(std::array{fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0});                 // k
  encoder.array(std::array{1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0});             // r
  encoder.array(std::array{fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0});  // p
  encoder(kNone, kNone, kNone, kNone, kNone, kNone, false);  // no binning, and the whole image
}

void encodeMarkers(const Header& header, std::span<const Marker> markers, std::string& to) {
  Encoder encoder(to);
  encoder(static_cast<std::uint32_t>(markers.size()));
  for (const Marker& marker : markers) {
    encoder(header, marker.name, marker.id, static_cast<std::int32_t>(marker.kind),
            static_cast<std::int32_t>(marker.action), marker.T_frame_marker, marker.scale_m, marker.colour);
    encoder(std::int32_t{0}, kNone, false);  // it stays until it is replaced, where it is
    encoder.list(marker.points_m);
    encoder(kNone, "", Header{}, "", kNone, kNone);  // no colours of points, and no texture
    encoder(marker.text, "", "", kNone, false);      // no mesh
  }
}

void encodeLog(std::int64_t time_ns, LogLevel level, std::string_view name, std::string_view text,
               std::string& to) {
  // neither file nor function nor line
  Encoder{to}(Time{time_ns}, static_cast<std::uint8_t>(level), name, text, "", "", kNone);
}

void encodeFlag(bool flag, std::string& to) {
  Encoder{to}(flag);
}

void encodeAnnouncement(const Announcement& announcement, std::string& to) {
  Encoder encoder(to);
  encoder(announcement.participant);
  encoder.list(announcement.nodes);
}

namespace {

/// Reads one message member by member.
class Decoder {
 public:
  explicit Decoder(std::string_view message) : from_(message, CdrOrder::any) {}

  void operator()(auto&... members) { (get(members), ...); }
  bool good() const { return from_.good(); }

  void get(Header& header) {
    std::int32_t seconds = 0;
    std::uint32_t rest_ns = 0;
    (*this)(seconds, rest_ns, header.frame);
    header.time_ns = seconds * rt::kNsPerSecond + rest_ns;
  }
  void get(StampedPose& m) { (*this)(m.header, m.pose.position_m_in_world, m.pose.orientation); }
  void get(StampedWrench& m) { (*this)(m.header, m.force_n, m.torque_n_m); }
  void get(StampedText& m) { (*this)(m.header, m.text); }
  void get(StampedState& m) { (*this)(m.header, m.state.state, m.state.is_homed, m.state.is_busy); }
  void get(StampedImpedance& m) {
    Impedance& i = m.impedance;
    rt::Quaternion torque_orientation;
    (*this)(m.header, i.force_orientation, i.force_position_m, torque_orientation, i.position_positive,
            i.position_negative, i.orientation_positive, i.orientation_negative);
  }
  void get(JointPositions& m) {
    std::vector<std::string_view> names;
    (*this)(m.header, names, m.positions);
  }
  void get(Flag& m) { get(m.flag); }
  void get(Announcement& m) { (*this)(m.participant, m.nodes); }

 private:
  template <CdrNumber Number>
  void get(Number& number) {
    number = from_.number<Number>();
  }
  void get(std::string_view& text) { text = from_.text(); }
  void get(rt::Vec3& v) { (*this)(v.x, v.y, v.z); }
  void get(rt::Quaternion& q) { (*this)(q.x, q.y, q.z, q.w); }
  void get(ImpedanceSide& side) { (*this)(side.p, side.d, side.bias, side.deadband); }
  void get(Gid& gid) {
    for (std::uint8_t& byte : gid) get(byte);
  }
  void get(AnnouncedNode& node) { (*this)(node.name_space, node.name, node.readers, node.writers); }
  template <typename Element>
  void get(std::vector<Element>& list) {
    const auto count = from_.number<std::uint32_t>();
    if (count > from_.left()) return from_.refuse();  // an element has at least a byte
    for (std::uint32_t i = 0; i < count && good(); ++i) get(list.emplace_back());
  }

  CdrReader from_;
};

}  // namespace

template <typename Message>
std::optional<Message> decode(std::string_view message) {
  Message content;
  Decoder decoder(message);
  decoder.get(content);
  return decoder.good() ? std::optional(std::move(content)) : std::nullopt;
}

template std::optional<StampedPose> decode(std::string_view message);
template std::optional<StampedWrench> decode(std::string_view message);
template std::optional<StampedText> decode(std::string_view message);
template std::optional<StampedState> decode(std::string_view message);
template std::optional<StampedImpedance> decode(std::string_view message);
template std::optional<JointPositions> decode(std::string_view message);
template std::optional<Flag> decode(std::string_view message);
template std::optional<Announcement> decode(std::string_view message);

}  // namespace hapticd::trace::ros
