// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <bit>
#include <cerrno>
#include <cmath>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/vm/emulators/tests/kernel_side.h"
#include "tests/vm/emulators/uvc/uvc_device.h"

namespace hapticd::test {
namespace {

/// As uvcvideo chooses them at a high-speed bulk endpoint.
constexpr std::uint32_t kUrbBytes = 16384;

/// One mode of few pixels, so that tests are fast.
uvc::CameraModel smallCamera(uvc::CameraModel model = uvc::realsenseD435()) {
  model.modes = {{128, 96, {30, 90}}, {64, 48, {30}}};
  return model;
}

/// The depth camera and the kernel's side of it.
class UvcRig {
 public:
  explicit UvcRig(uvc::CameraModel model = smallCamera())
      : device_(std::move(model), [](std::string_view) {}) {
    plug();
  }

  void plug() {
    const SocketPair sockets;
    connection_ =
        std::make_unique<usbip::Connection>(sockets.device, device_, counts_, [](std::string_view) {});
    host_ = std::make_unique<KernelSide>(sockets.kernel);
  }
  KernelSide& host() { return *host_; }
  uvc::UvcDevice& device() { return device_; }
  void tell(std::string_view line) { EXPECT_EQ(device_.command(line), "ok") << line; }

  void serve() {
    connection_->receive();
    device_.work(now_ns_, *connection_);
  }
  void advance(std::int64_t by_ns) {
    now_ns_ += by_ns;
    serve();
  }

  KernelSide::Reply descriptor(std::uint16_t value, std::uint16_t length = 4096) {
    host_->submitIn(0x80, 6, value, length);
    serve();
    return host_->next();
  }
  /// entity: of the control interface (0), or interface 1.
  KernelSide::Reply get(std::uint8_t request, std::uint8_t selector, std::uint16_t index,
                        std::uint16_t length) {
    host_->submitIn(0xa1, request, static_cast<std::uint16_t>(selector << 8), length, index);
    serve();
    return host_->next();
  }
  KernelSide::Reply set(std::uint8_t selector, std::uint16_t index, const Bytes& data) {
    host_->submitOut(0x21, 1, static_cast<std::uint16_t>(selector << 8), data, index);
    serve();
    return host_->next();
  }
  /// Commits mode `frame` (1 for the first) at the interval in units of 100 ns.
  void commit(std::uint8_t frame, std::uint32_t interval) {
    Bytes proposal = get(0x81, 1, 1, 34).data;
    ASSERT_EQ(proposal.size(), 34U);
    proposal[2] = 1;
    proposal[3] = frame;
    for (unsigned i = 0; i < 4; ++i) proposal[4 + i] = static_cast<std::uint8_t>(interval >> 8 * i & 0xff);
    EXPECT_EQ(set(2, 1, proposal).status, 0);
  }
  /// The next payload: URBs until one is not full.
  Bytes payload() {
    Bytes joined;
    for (;;) {
      host_->submitBulk(0x82, kUrbBytes);
      serve();
      if (host_->hasNothing()) advance(1'000'000'000 / 30);
      const KernelSide::Reply reply = host_->next();
      joined.insert(joined.end(), reply.data.begin(), reply.data.end());
      if (reply.data.size() < kUrbBytes) return joined;
    }
  }

 private:
  usbip::UrbCounts counts_;
  uvc::UvcDevice device_;
  std::unique_ptr<usbip::Connection> connection_;
  std::unique_ptr<KernelSide> host_;
  std::int64_t now_ns_ = 5'000'000'000;
};

/// Little-endian numbers, read without the emulator's own code.
std::uint32_t word(const Bytes& bytes, std::size_t at, std::size_t count = 4) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < count; ++i) value |= std::uint32_t{bytes.at(at + i)} << 8 * i;
  return value;
}

float real(const Bytes& bytes, std::size_t at) {
  return std::bit_cast<float>(word(bytes, at));
}

// The emulated depth camera as a kernel meets it: descriptors, negotiation, payloads. Offsets: USB Video
// Class 1.1, tables 2-6 and 4-75.

constexpr std::size_t kHeaderBytes = 12 + 40 + 40 + 60;
constexpr std::size_t kFrameBytes = 128 * 96 * 2;
constexpr std::uint32_t k30Hz = 333333;

/// The descriptors in a configuration, one after the other; throws where one is longer than the rest.
std::vector<Bytes> taken(const Bytes& configuration) {
  std::vector<Bytes> all;
  for (std::size_t at = 0; at < configuration.size(); at += configuration.at(at)) {
    const std::size_t length = configuration[at];
    if (length < 2 || at + length > configuration.size()) throw std::runtime_error("a descriptor is cut");
    all.emplace_back(configuration.begin() + static_cast<std::ptrdiff_t>(at),
                     configuration.begin() + static_cast<std::ptrdiff_t>(at + length));
  }
  return all;
}

/// Class descriptors of a subtype behind the interface descriptor of that subclass.
std::vector<Bytes> ofClass(const std::vector<Bytes>& all, std::uint8_t subclass, std::uint8_t subtype) {
  std::vector<Bytes> found;
  std::uint8_t current = 0;
  for (const Bytes& one : all) {
    if (one[1] == 4) current = one[6];
    if (one[1] == 0x24 && current == subclass && one[2] == subtype) found.push_back(one);
  }
  return found;
}

TEST(EmulatedDepthCamera, DescribesItselfInDescriptorsWhoseLengthsAddUp) {
  UvcRig rig(uvc::realsenseD435());
  const Bytes configuration = rig.descriptor(0x0200).data;
  EXPECT_EQ(word(configuration, 2, 2), configuration.size());
  const auto all = taken(configuration);
  std::map<std::uint8_t, std::size_t> bytes;
  std::uint8_t subclass = 0;
  for (const Bytes& one : all) {
    if (one[1] == 4) subclass = one[6];
    if (one[1] == 0x24) bytes[subclass] += one.size();
  }
  EXPECT_EQ(word(ofClass(all, 1, 1).at(0), 5, 2), bytes[1]);
  EXPECT_EQ(word(ofClass(all, 2, 1).at(0), 4, 2), bytes[2]);
  const Bytes processing = ofClass(all, 1, 5).at(0);
  EXPECT_EQ(processing.size(), 10U + processing.at(7));
}

TEST(EmulatedDepthCamera, OffersEachModeAsZ16AndItsUnitAsThatOfRealsense) {
  UvcRig rig(uvc::realsenseD435());
  const auto all = taken(rig.descriptor(0x0200).data);
  const auto frames = ofClass(all, 2, 5);
  const Bytes format = ofClass(all, 2, 4).at(0);
  EXPECT_EQ(Bytes(format.begin() + 5, format.begin() + 21),
            (Bytes{'Z', '1', '6', ' ', 0, 0, 0x10, 0, 0x80, 0, 0, 0xaa, 0, 0x38, 0x9b, 0x71}));
  ASSERT_EQ(frames.size(), 6U);
  EXPECT_EQ(word(frames[1], 5, 2), 848U);
  EXPECT_EQ(word(frames[1], 7, 2), 480U);
  EXPECT_EQ(word(frames[1], 17), 848U * 480 * 2);
  EXPECT_EQ(word(frames[1], 34), 111111U) << "90 Hz";
  const Bytes unit = ofClass(all, 1, 6).at(0);
  EXPECT_EQ(unit[3], 3U);
  // C9606CCB-594C-4D25-AF47-CCC496435995: the first three groups are little-endian
  EXPECT_EQ(Bytes(unit.begin() + 4, unit.begin() + 20),
            (Bytes{0xcb, 0x6c, 0x60, 0xc9, 0x4c, 0x59, 0x25, 0x4d, 0xaf, 0x47, 0xcc, 0xc4, 0x96, 0x43, 0x59,
                   0x95}));
}

TEST(EmulatedDepthCamera, ShowsFaultsOfDescriptorsWhenItIsPluggedInAgain) {
  UvcRig rig;
  const Bytes good = rig.descriptor(0x0200).data;
  for (const char* fault : {"lies-about-size", "unknown-format", "no-frames", "frame-zero", "interval-zero",
                            "no-endpoint", "no-unit", "descriptor-cut"}) {
    rig.tell(std::string("fault ") + fault);
    EXPECT_EQ(rig.descriptor(0x0200).data, good) << fault << " before that";
    rig.plug();
    EXPECT_NE(rig.descriptor(0x0200).data, good) << fault;
    rig.tell("resume");
    rig.plug();
    EXPECT_EQ(rig.descriptor(0x0200).data, good) << fault << " is over";
  }
}

TEST(EmulatedDepthStream, AnswersAProposalWithWhatItWouldDo) {
  UvcRig rig;
  Bytes proposal(34);
  proposal[2] = 1;
  proposal[3] = 1;
  proposal[4] = 0x40;  // 120000, 83 Hz
  proposal[5] = 0xd4;
  proposal[6] = 0x01;
  EXPECT_EQ(rig.set(1, 1, proposal).status, 0);
  const Bytes answer = rig.get(0x81, 1, 1, 34).data;
  EXPECT_EQ(word(answer, 4), 111111U) << "the nearest interval";
  EXPECT_EQ(word(answer, 18), kFrameBytes);
  EXPECT_EQ(word(answer, 22), kFrameBytes + kHeaderBytes) << "one payload per frame";
  proposal[3] = 9;
  EXPECT_EQ(rig.set(1, 1, proposal).status, 0);
  EXPECT_EQ(rig.get(0x81, 1, 1, 34).data.at(3), 1U) << "a mode that there is";
}

TEST(EmulatedDepthStream, SendsAFrameAsOnePayloadOfUrbs) {
  UvcRig rig;
  rig.commit(1, k30Hz);
  const Bytes first = rig.payload();
  ASSERT_EQ(first.size(), kHeaderBytes + kFrameBytes);
  EXPECT_EQ(first[0], kHeaderBytes);
  EXPECT_EQ(first[1] & 0x8e, 0x8e) << "end of header and frame, presentation and source time";
  const Bytes second = rig.payload();
  EXPECT_EQ((first[1] ^ second[1]) & 1, 1) << "the frame id alternates";
  EXPECT_NEAR(word(second, 2) - word(first, 2), 33333U, 1) << "presentation time, microseconds";
}

TEST(EmulatedDepthStream, PutsTimesIntoTheMetadataAsTheKernelsDocumentHasThem) {
  UvcRig rig;
  rig.commit(1, k30Hz);
  rig.payload();
  const Bytes payload = rig.payload();
  EXPECT_EQ(word(payload, 12), 0x80000001U);
  EXPECT_EQ(word(payload, 16), 40U);
  EXPECT_EQ(word(payload, 28), 1U) << "frame counter";
  EXPECT_EQ(word(payload, 32), word(payload, 40) / 2) << "optical time is half the exposure";
  EXPECT_EQ(word(payload, 44), 33333U) << "interval";
  EXPECT_EQ(word(payload, 52), 0x80000002U);
  EXPECT_EQ(word(payload, 76, 2) + (word(payload, 78, 2) << 16), 128U + (96U << 16)) << "width and height";
  EXPECT_EQ(word(payload, 92), 0x80000000U);
  EXPECT_EQ(word(payload, 96), 60U);
}

TEST(EmulatedDepthStream, SendsThePixelsOfTheTiltedPlaneAndTheSphere) {
  UvcRig rig;
  rig.commit(1, k30Hz);
  const Bytes payload = rig.payload();
  // rectified intrinsics of 90 degrees over 128 pixels, principal point 1.75 right and 2.25 above the centre
  const double f = 64, cx = 65.75, cy = 45.75, radius = 0.06;
  std::size_t on_plane = 0, on_sphere = 0;
  for (std::size_t row = 1; row < 96; ++row) {
    for (std::size_t column = 0; column < 128; ++column) {
      const double z = word(payload, kHeaderBytes + 2 * (row * 128 + column), 2) * 0.001;
      const double x = (static_cast<double>(column) - cx) / f * z,
                   y = (static_cast<double>(row) - cy) / f * z;
      // half a step of 1 mm along a ray of at most 1.6 lengths of its z
      const bool plane = std::abs(z + 0.25 * x + 0.1 * y - 0.6) < 0.8e-3;
      const double from_centre = std::hypot(x + 0.07, y - 0.01, z - 0.45);
      const bool sphere = std::abs(from_centre - radius) < 0.8e-3;
      EXPECT_TRUE(plane || sphere) << column << ' ' << row << ' ' << z;
      on_plane += plane;
      on_sphere += sphere;
    }
  }
  EXPECT_GT(on_plane, 10'000U);
  EXPECT_GT(on_sphere, 100U);
}

TEST(EmulatedDepthStream, BeginsFramesByTheClockAndSkipsThoseThatTheHostHasNoRoomFor) {
  UvcRig rig;
  rig.commit(1, k30Hz);
  rig.payload();
  rig.host().submitBulk(0x82, kUrbBytes);
  rig.serve();
  EXPECT_TRUE(rig.host().hasNothing()) << "the next frame is not due";
  rig.advance(33'333'300);
  EXPECT_EQ(rig.host().next().data.size(), kUrbBytes);
  rig.advance(3 * 33'333'300);
  EXPECT_NE(rig.device().status().find("\"skipped\":3,"), std::string::npos) << rig.device().status();
}

TEST(EmulatedDepthStream, EndsWhenTheHostClearsTheHaltOfTheEndpoint) {
  UvcRig rig;
  rig.commit(1, k30Hz);
  rig.payload();
  rig.host().submitOut(0x02, 1, 0, {}, 0x82);
  rig.serve();
  EXPECT_EQ(rig.host().next().status, 0);
  EXPECT_NE(rig.device().status().find("\"streaming\":false"), std::string::npos);
  rig.host().submitBulk(0x82, kUrbBytes);
  rig.advance(1'000'000'000);
  EXPECT_TRUE(rig.host().hasNothing());
}

TEST(EmulatedDepthStream, DamagesFramesUntilItResumes) {
  UvcRig rig;
  rig.commit(1, k30Hz);
  const Bytes whole = rig.payload();
  const auto with = [&rig](const char* fault) {
    rig.tell(std::string("fault ") + fault);
    Bytes payload = rig.payload();
    rig.tell("resume");
    return payload;
  };
  EXPECT_EQ(with("header-long")[0], 0xff);
  EXPECT_EQ(with("header-short")[0], 1);
  EXPECT_EQ(with("error-bit")[1] & 0x40, 0x40);
  EXPECT_EQ(with("frame-short").size(), kHeaderBytes + kFrameBytes / 2);
  EXPECT_EQ(with("frame-long").size(), whole.size() + 4096);
  EXPECT_EQ(with("other-size").size(), kHeaderBytes + kFrameBytes * 3 / 4);
  EXPECT_EQ(with("empty-payload").size(), kHeaderBytes);
  const Bytes before = rig.payload(), stuck = with("frame-id-stuck");
  EXPECT_EQ(before[1] & 1, stuck[1] & 1);
  const Bytes repeated = with("frame-repeated");
  EXPECT_EQ(Bytes(stuck.begin() + kHeaderBytes, stuck.end()),
            Bytes(repeated.begin() + kHeaderBytes, repeated.end()));
  EXPECT_EQ(rig.payload().size(), whole.size());
}

TEST(EmulatedDepthStream, LeavesRequestsOfTheClassUnansweredWhileMute) {
  UvcRig rig;
  rig.tell("fault mute");
  rig.host().submitIn(0xa1, 0x81, 0x0100, 34, 1);
  rig.serve();
  EXPECT_TRUE(rig.host().hasNothing());
  EXPECT_EQ(rig.descriptor(0x0100, 18).data.size(), 18U) << "it is still found";
}

// Their extension units, asked as their vendors' libraries ask.

constexpr std::uint16_t kUnit = 0x0300;

void add(Bytes& bytes, std::uint32_t value, unsigned count = 4) {
  for (unsigned i = 0; i < count; ++i) bytes.push_back(static_cast<std::uint8_t>(value >> 8 * i & 0xff));
}

/// CRC-32 bit by bit, reflected polynomial 0xEDB88320.
std::uint32_t checksum(const Bytes& bytes, std::size_t from) {
  std::uint32_t crc = 0xffffffff;
  for (std::size_t i = from; i < bytes.size(); ++i) {
    crc ^= bytes[i];
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ ((crc & 1) != 0 ? 0xedb88320 : 0);
  }
  return ~crc;
}

class EmulatedRealsenseUnit : public testing::Test {
 protected:
  /// The data of the reply to a command of the hardware monitor, which must echo the opcode.
  Bytes answer(std::uint32_t opcode, std::uint32_t p1 = 0, std::uint32_t p2 = 0, const Bytes& data = {}) {
    Bytes request;
    add(request, static_cast<std::uint32_t>(20 + data.size()), 2);
    add(request, 0xcdab, 2);
    for (const std::uint32_t value : {opcode, p1, p2, 0U, 0U}) add(request, value);
    request.insert(request.end(), data.begin(), data.end());
    request.resize(1024);
    EXPECT_EQ(rig_.set(1, kUnit, request).status, 0);
    const Bytes reply = rig_.get(0x81, 1, kUnit, 1024).data;
    EXPECT_EQ(word(reply, 0), opcode);
    return {reply.begin() + 4, reply.begin() + 4 + word(reply, 1020)};
  }

  UvcRig rig_{uvc::realsenseD435()};
};

TEST_F(EmulatedRealsenseUnit, HasACoefficientsTableWithChecksum) {
  const Bytes table = answer(0x15, 25);
  ASSERT_EQ(table.size(), 576U);
  EXPECT_EQ(word(table, 2, 2), 25U);
  EXPECT_EQ(word(table, 4), 560U);
  EXPECT_EQ(word(table, 12), checksum(table, 16));
  EXPECT_EQ(real(table, 160), -50.0F) << "baseline, mm";
  EXPECT_NEAR(real(table, 256 + 3 * 16), 424, 1e-3) << "848x480 is the fourth";
  EXPECT_NEAR(real(table, 256 + 5 * 16), 212, 1e-3) << "424x240 is the sixth";
}

TEST_F(EmulatedRealsenseUnit, TakesAnotherDepthUnitAndSendsDepthInIt) {
  EXPECT_EQ(word(answer(0x2c, 9), 0), 1000U);
  Bytes table;
  for (const std::uint32_t value : {100U, 0U, 65535U, 0U, 0U}) add(table, value);
  answer(0x2b, 9, 0, table);
  EXPECT_EQ(word(answer(0x2c, 9), 0), 100U);
  EXPECT_EQ(word(answer(0x2c, 9, 1), 0), 40U) << "least";
  rig_.commit(6, 333333);
  const Bytes payload = rig_.payload();
  // the plane at the principal point, z = 0.6 m, behind the sphere's lower edge
  EXPECT_NEAR(word(payload, payload.size() - 2, 2),
              0.6e4 / (1 + 0.25 * (423 - 213.75) / 212 + 0.1 * (239 - 117.75) / 212), 1);
}

class EmulatedOrbbecUnit : public testing::Test {
 protected:
  Bytes ask(std::uint16_t opcode, const std::vector<std::uint32_t>& words, std::uint8_t reply_selector = 2) {
    Bytes request;
    add(request, 0x4d47, 2);
    add(request, static_cast<std::uint32_t>(words.size() * 2), 2);
    add(request, opcode, 2);
    add(request, 7, 2);
    for (const std::uint32_t value : words) add(request, value);
    request.resize(64);
    EXPECT_EQ(rig_.set(2, kUnit, request).status, 0);
    const std::uint16_t reply_bytes = reply_selector == 3 ? 1024 : reply_selector == 1 ? 512 : 64;
    return rig_.get(0x81, reply_selector, kUnit, reply_bytes).data;
  }
  /// The response's data, after its header without an error.
  Bytes answer(std::uint16_t opcode, const std::vector<std::uint32_t>& words,
               std::uint8_t reply_selector = 2) {
    const Bytes reply = ask(opcode, words, reply_selector);
    EXPECT_EQ(Bytes(reply.begin(), reply.begin() + 2), (Bytes{0x52, 0x42}));
    EXPECT_EQ(word(reply, 4, 2), opcode);
    EXPECT_EQ(word(reply, 6, 2), 7U) << "the request's number";
    EXPECT_EQ(word(reply, 8, 2), 0U) << "error";
    return {reply.begin() + 10, reply.begin() + 8 + 2 * word(reply, 2, 2)};
  }

  UvcRig rig_{uvc::gemini335()};
};

TEST_F(EmulatedOrbbecUnit, TellsItsDepthUnitAndTakesAnother) {
  EXPECT_EQ(real(answer(1, {176}), 0), 1.0F);
  answer(2, {176, std::bit_cast<std::uint32_t>(0.1F)});
  EXPECT_EQ(real(answer(1, {176}), 0), 0.1F);
  EXPECT_EQ(word(answer(1, {75}), 0), 3U) << "the level of that precision";
  EXPECT_NE(word(ask(2, {75, 99}), 8, 2), 0U);
}

TEST_F(EmulatedOrbbecUnit, ListsTheParametersOfEachMode) {
  const Bytes told = answer(29, {4027});
  EXPECT_EQ(word(told, 0, 2), 0U) << "version of the structure";
  const std::uint32_t bytes = word(told, 2);
  ASSERT_EQ(bytes, 4 * 152U);
  const Bytes list = answer(30, {4027, 0, bytes}, 3);
  ASSERT_EQ(list.size(), bytes);
  // half of 848 pixels over the tangent of 43 degrees
  EXPECT_NEAR(real(list, 0), 454.69, 0.01);
  EXPECT_NEAR(real(list, 8), 425.75, 1e-3);
  EXPECT_EQ(word(list, 16, 2), 848U);
  EXPECT_EQ(word(list, 18, 2), 480U);
  EXPECT_EQ(word(list, 152 + 16, 2), 640U) << "the second mode";
  answer(31, {4027});
  EXPECT_NE(word(ask(30, {4027, 0, bytes}, 3), 8, 2), 0U) << "it has ended";
}

}  // namespace
}  // namespace hapticd::test
