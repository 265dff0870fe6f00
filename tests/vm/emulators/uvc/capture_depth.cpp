// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <fmt/format.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sysexits.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "config/base/error.h"
#include "config/base/program.h"
#include "rt/base/clock.h"
#include "tests/vm/emulators/uvc/depth_scene.h"
#include "tools/lib/options/option_checks.h"

namespace hapticd::test::uvc {
namespace {

constexpr std::uint32_t kBuffers = 8;

template <typename Argument>
bool request(int file, unsigned long code, Argument& argument) {
  int result = 0;
  do {
    result = ::ioctl(file, code, &argument);
  } while (result < 0 && errno == EINTR);
  return result == 0;
}

std::uint32_t codeOf(const std::string& fourcc) {
  std::uint32_t code = 0;
  std::memcpy(&code, fourcc.data(), sizeof code);
  return code;
}

struct CaptureFormat {
  std::string fourcc = "Z16 ";
  std::uint32_t width_px = 0;
  std::uint32_t height_px = 0;
  std::uint32_t rate_hz = 0;
};

/// A filled buffer of the kernel, valid until the next call of next().
struct CapturedFrame {
  std::span<const std::uint16_t> pixels;
  std::uint32_t sequence = 0;
  std::uint32_t bytes = 0;
  bool error = false;  ///< the kernel marks the frame as damaged
};

/// A stream from a node of V4L2 through memory that is shared with the kernel.  Thread: one.
class V4l2Capture {
 public:
  /// Opens the node, sets the format and starts streaming.
  /// Errors: the node, or the kernel refuses the format or has another one.
  static base::Result<std::unique_ptr<V4l2Capture>> start(const std::string& device,
                                                          const CaptureFormat& format);
  ~V4l2Capture();
  V4l2Capture(const V4l2Capture&) = delete;
  V4l2Capture& operator=(const V4l2Capture&) = delete;

  /// The next frame, nothing if none comes in that time.  Errors: the device is gone.
  base::Result<std::optional<CapturedFrame>> next(std::chrono::milliseconds patience);
  /// What the kernel has set as the time between two frames.
  std::uint32_t interval_us() const { return interval_us_; }

 private:
  struct Buffer {
    void* begin;
    std::size_t bytes;
  };

  explicit V4l2Capture(std::string device) : device_(std::move(device)) {}
  base::Result<void> setFormat(const CaptureFormat& format);
  base::Result<void> setRate(std::uint32_t rate_hz);
  base::Result<void> shareBuffers();
  base::Result<void> giveBack(std::uint32_t index);
  std::unexpected<base::Error> failed(const std::string& what) const;

  std::string device_;
  int file_ = -1;
  std::uint32_t interval_us_ = 0;
  std::vector<Buffer> buffers_;
  std::optional<std::uint32_t> held_;  // the buffer that next() has returned
};

std::unexpected<base::Error> V4l2Capture::failed(const std::string& what) const {
  return std::unexpected(base::Error{device_, what + ": " + std::strerror(errno), ""});
}

base::Result<std::unique_ptr<V4l2Capture>> V4l2Capture::start(const std::string& device,
                                                              const CaptureFormat& format) {
  std::unique_ptr<V4l2Capture> capture(new V4l2Capture(device));
  capture->file_ = ::open(device.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (capture->file_ < 0) return capture->failed("open");
  if (auto done = capture->setFormat(format); !done) return std::unexpected(done.error());
  if (auto done = capture->setRate(format.rate_hz); !done) return std::unexpected(done.error());
  if (auto done = capture->shareBuffers(); !done) return std::unexpected(done.error());
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (!request(capture->file_, VIDIOC_STREAMON, type)) return capture->failed("VIDIOC_STREAMON");
  return capture;
}

V4l2Capture::~V4l2Capture() {
  if (file_ < 0) return;
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request(file_, VIDIOC_STREAMOFF, type);
  for (const Buffer& buffer : buffers_) ::munmap(buffer.begin, buffer.bytes);
  ::close(file_);
}

base::Result<void> V4l2Capture::setFormat(const CaptureFormat& format) {
  v4l2_format asked{};
  asked.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  asked.fmt.pix.width = format.width_px;
  asked.fmt.pix.height = format.height_px;
  asked.fmt.pix.pixelformat = codeOf(format.fourcc);
  asked.fmt.pix.field = V4L2_FIELD_NONE;
  if (!request(file_, VIDIOC_S_FMT, asked)) return failed("VIDIOC_S_FMT");
  const v4l2_pix_format& has = asked.fmt.pix;
  if (has.pixelformat == codeOf(format.fourcc) && has.width == format.width_px &&
      has.height == format.height_px) {
    return {};
  }
  std::string code(4, ' ');
  std::memcpy(code.data(), &has.pixelformat, code.size());
  return std::unexpected(
      base::Error{device_, fmt::format("offers {} {}x{} instead", code, has.width, has.height), ""});
}

base::Result<void> V4l2Capture::setRate(std::uint32_t rate_hz) {
  v4l2_streamparm asked{};
  asked.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  asked.parm.capture.timeperframe = {1, rate_hz};
  if (!request(file_, VIDIOC_S_PARM, asked)) return failed("VIDIOC_S_PARM");
  const v4l2_fract& has = asked.parm.capture.timeperframe;
  interval_us_ = static_cast<std::uint32_t>(std::uint64_t{has.numerator} * 1'000'000 / has.denominator);
  return {};
}

base::Result<void> V4l2Capture::shareBuffers() {
  v4l2_requestbuffers asked{};
  asked.count = kBuffers;
  asked.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  asked.memory = V4L2_MEMORY_MMAP;
  if (!request(file_, VIDIOC_REQBUFS, asked)) return failed("VIDIOC_REQBUFS");
  for (std::uint32_t index = 0; index < asked.count; ++index) {
    v4l2_buffer buffer{};
    buffer.index = index;
    buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    buffer.memory = V4L2_MEMORY_MMAP;
    if (!request(file_, VIDIOC_QUERYBUF, buffer)) return failed("VIDIOC_QUERYBUF");
    void* const begin =
        ::mmap(nullptr, buffer.length, PROT_READ, MAP_SHARED, file_, static_cast<off_t>(buffer.m.offset));
    if (begin == MAP_FAILED) return failed("mmap");
    buffers_.push_back({begin, buffer.length});
    if (auto done = giveBack(index); !done) return done;
  }
  return {};
}

base::Result<void> V4l2Capture::giveBack(std::uint32_t index) {
  v4l2_buffer buffer{};
  buffer.index = index;
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  if (!request(file_, VIDIOC_QBUF, buffer)) return failed("VIDIOC_QBUF");
  return {};
}

base::Result<std::optional<CapturedFrame>> V4l2Capture::next(std::chrono::milliseconds patience) {
  if (const auto held = std::exchange(held_, std::nullopt)) {
    if (auto done = giveBack(*held); !done) return std::unexpected(done.error());
  }
  pollfd waiting{file_, POLLIN, 0};
  if (::poll(&waiting, 1, static_cast<int>(patience.count())) == 0) return std::nullopt;
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  if (!request(file_, VIDIOC_DQBUF, buffer)) {
    if (errno == EAGAIN) return std::nullopt;
    return failed("VIDIOC_DQBUF");
  }
  held_ = buffer.index;
  const auto* const pixels = static_cast<const std::uint16_t*>(buffers_[buffer.index].begin);
  return CapturedFrame{.pixels = {pixels, buffer.bytesused / sizeof(std::uint16_t)},
                       .sequence = buffer.sequence,
                       .bytes = buffer.bytesused,
                       .error = (buffer.flags & V4L2_BUF_FLAG_ERROR) != 0};
}

struct Options {
  std::string device;
  std::string model = "d435";
  CaptureFormat format{.width_px = 640, .height_px = 480, .rate_hz = 30};
  std::uint32_t unit_um = 1000;
  double seconds = 5;
};

struct Counts {
  std::uint64_t frames = 0;
  std::uint64_t lost = 0;          ///< gaps of the kernel's numbers
  std::uint64_t skipped = 0;       ///< gaps of the camera's numbers
  std::uint64_t damaged = 0;       ///< marked by the kernel, or of the wrong size
  std::uint64_t wrong_frames = 0;  ///< with wrong pixels
  std::uint64_t wrong_pixels = 0;
  std::uint64_t silences = 0;  ///< half a second without a frame
  std::uint32_t first_number = 0;
  std::uint32_t last_number = 0;
  std::string ended = "in time";
};

/// Compares frames with the emulated camera's scene.
class Checker {
 public:
  explicit Checker(const Options& options)
      : scene_(static_cast<std::uint16_t>(options.format.width_px),
               static_cast<std::uint16_t>(options.format.height_px),
               intrinsicsOf(*modelNamed(options.model), static_cast<std::uint16_t>(options.format.width_px),
                            static_cast<std::uint16_t>(options.format.height_px)),
               options.unit_um),
        expected_(scene_.pixels()) {}

  void check(const CapturedFrame& frame, Counts& counts) {
    if (counts.frames++ != 0) counts.lost += frame.sequence - sequence_ - 1;
    sequence_ = frame.sequence;
    if (frame.error || frame.pixels.size() != expected_.size()) {
      ++counts.damaged;
      return;
    }
    const std::uint32_t number = frameNumberIn(frame.pixels);
    if (numbered_) {
      counts.skipped += number - counts.last_number - 1;
    } else {
      counts.first_number = number;
    }
    numbered_ = true;
    counts.last_number = number;
    scene_.write(number, expected_);
    if (std::memcmp(expected_.data(), frame.pixels.data(), frame.bytes) == 0) return;
    ++counts.wrong_frames;
    for (std::size_t i = 0; i < expected_.size(); ++i) counts.wrong_pixels += expected_[i] != frame.pixels[i];
  }

 private:
  DepthScene scene_;
  std::vector<std::uint16_t> expected_;
  std::uint32_t sequence_ = 0;
  bool numbered_ = false;
};

int fail(const base::Error& error, int status) {
  std::fputs(fmt::format("capture-depth: {}\n", error.text()).c_str(), stderr);
  return status;
}

int capture(const Options& options) {
  constexpr std::chrono::milliseconds kPatience{500};
  Checker checker(options);
  const auto stream = V4l2Capture::start(options.device, options.format);
  if (!stream) return fail(stream.error(), EX_UNAVAILABLE);
  Counts counts;
  const std::int64_t end_ns = rt::monotonicNow_ns() + static_cast<std::int64_t>(options.seconds * 1e9);
  while (rt::monotonicNow_ns() < end_ns) {
    const auto frame = (*stream)->next(kPatience);
    if (!frame) {
      counts.ended = frame.error().what;
      break;
    }
    if (*frame) {
      checker.check(**frame, counts);
    } else {
      ++counts.silences;
    }
  }
  fmt::print(R"({{"interval_us":{},"frames":{},"lost":{},"skipped":{},"damaged":{},"wrong_frames":{},)"
             R"("wrong_pixels":{},"silences":{},"first_number":{},"last_number":{},"ended":"{}"}})"
             "\n",
             (*stream)->interval_us(), counts.frames, counts.lost, counts.skipped, counts.damaged,
             counts.wrong_frames, counts.wrong_pixels, counts.silences, counts.first_number,
             counts.last_number, counts.ended);
  return EX_OK;
}

int run(int argc, char** argv) {
  CLI::App app{
      "capture-depth: streams from a V4L2 node and compares each pixel with the scene of "
      "emulated-depth-camera.\nPrints one line of JSON."};
  app.footer("Exit status: 0 streamed, whatever arrived, 64 usage, 69 the node cannot be used.");
  Options options;
  app.add_option("--device", options.device, "the node")->type_name("PATH")->required();
  app.add_option("--model", options.model, "d435 or gemini335 (d435)")
      ->type_name("NAME")
      ->check(CLI::IsMember({"d435", "gemini335"}));
  app.add_option("--format", options.format.fourcc, "fourcc, four characters (\"Z16 \")")
      ->type_name("CODE")
      ->check([](const std::string& code) { return code.size() == 4 ? "" : "it has not four characters"; });
  app.add_option("--width", options.format.width_px, "pixels (640)")->check(tools::within(16U, 1920U));
  app.add_option("--height", options.format.height_px, "pixels (480)")->check(tools::within(16U, 1200U));
  app.add_option("--rate", options.format.rate_hz, "frames per second (30)")->check(tools::within(1U, 300U));
  app.add_option("--unit-um", options.unit_um, "micrometres per step (1000)")
      ->check(tools::within(10U, 25000U));
  app.add_option("--seconds", options.seconds, "how long (5)")->check(tools::within(0.1, 3600.0));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return base::endWithoutWork(app, error, EX_USAGE);
  }
  return capture(options);
}

}  // namespace
}  // namespace hapticd::test::uvc

int main(int argc, char** argv) {
  return hapticd::base::runProgram("capture-depth", [&] { return hapticd::test::uvc::run(argc, argv); });
}
