// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/v4l2/camera_report.h"

#include <fmt/format.h>
#include <linux/usb/video.h>
#include <linux/uvcvideo.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <vector>

#include "config/settings/depth_cameras.h"
#include "drivers/camera/v4l2/orbbec_messages.h"
#include "drivers/camera/v4l2/realsense_messages.h"

namespace hapticd::drivers {
namespace {

/// The size of the frames that the configuration asks for.
FrameSize sizeOf(const config::CameraSettings& settings) {
  const rt::DepthModelParameters wanted = settings.effectiveDepthModel();
  return {wanted.width_px, wanted.height_px};
}

constexpr std::uint8_t kUnit = 3;  // the extension unit of both vendors
constexpr double kFineUnit_um = config::kFineUnit_m * 1e6;
constexpr double kMaxRaw = 65535;

base::Error failure(std::string what, std::string remedy) {
  return {"v4l2", std::move(what), std::move(remedy)};
}

/// A control of the extension unit.  Errors: as errno.
class ExtensionUnit {
 public:
  explicit ExtensionUnit(const OpenDevice& device) : device_(device) {}

  base::Result<void> set(std::uint8_t selector, std::vector<std::byte> data) const {
    return query(UVC_SET_CUR, selector, data);
  }
  base::Result<std::vector<std::byte>> get(std::uint8_t selector, std::size_t bytes) const {
    std::vector<std::byte> data(bytes);
    if (auto done = query(UVC_GET_CUR, selector, data); !done) return std::unexpected(done.error());
    return data;
  }

 private:
  base::Result<void> query(std::uint8_t kind, std::uint8_t selector, std::vector<std::byte>& data) const {
    uvc_xu_control_query request{};
    request.unit = kUnit;
    request.selector = selector;
    request.query = kind;
    request.size = static_cast<std::uint16_t>(data.size());
    request.data = reinterpret_cast<std::uint8_t*>(data.data());
    const int result = device_.ioctl(UVCIOC_CTRL_QUERY, &request);
    if (result >= 0) return {};
    return std::unexpected(
        failure(whatFails(selector, data.size(), result),
                "update the camera's firmware, or unplug the camera and plug it in again"));
  }

  /// result: a negative errno, which the kernel uses in ways of its own here
  static std::string whatFails(std::uint8_t selector, std::size_t bytes, int result) {
    if (result == -ENOENT) {
      return fmt::format("the camera has no control {} in its extension unit {}, or refuses it", selector,
                         kUnit);
    }
    if (result == -ENOBUFS) {
      return fmt::format("the camera's control {} does not have {} bytes", selector, bytes);
    }
    if (result == -ETIMEDOUT) return fmt::format("the camera does not answer at its control {}", selector);
    return fmt::format("the camera's control {} fails: {}", selector, std::strerror(-result));
  }

  const OpenDevice& device_;
};

std::vector<std::byte> oneByte(unsigned value) {
  return {static_cast<std::byte>(value)};
}

class RealSense {
 public:
  explicit RealSense(const OpenDevice& device) : unit_(device) {}

  base::Result<std::vector<std::byte>> call(const realsense::Request& request) const {
    constexpr std::uint8_t kMonitor = 1;
    if (auto sent = unit_.set(kMonitor, realsense::encoded(request)); !sent) {
      return std::unexpected(sent.error());
    }
    const auto reply = unit_.get(kMonitor, realsense::kMonitorBytes);
    if (!reply) return std::unexpected(reply.error());
    return realsense::replyData(request.command, *reply);
  }

  base::Result<CameraReport> prepare(const config::CameraSettings& settings) const {
    CameraReport report;
    const auto data = call({realsense::Command::device_data});
    if (!data) {
      report.problem = data.error().text();
      return report;
    }
    if (const auto device = realsense::deviceDataFrom(*data)) {
      report.firmware = device->firmware;
      report.serial = device->serial;
    }
    readCalibration(sizeOf(settings), report);
    if (auto unit = setDepthUnit(settings, report); !unit) return std::unexpected(unit.error());
    if (auto set = setControls(settings.of<V4l2Settings>()); !set) return std::unexpected(set.error());
    return report;
  }

  std::optional<double> temperature() const {
    constexpr std::uint8_t kTemperatures = 9;
    const auto control = unit_.get(kTemperatures, 4);
    return control ? realsense::temperatureFrom(*control) : std::nullopt;
  }

 private:
  void readCalibration(FrameSize size, CameraReport& report) const {
    if (const auto modes = call({realsense::Command::depth_modes})) {
      const auto pinhole = realsense::pinholeOfMode(*modes, size);
      if (pinhole) report.pinhole = *pinhole;
      if (!pinhole) report.problem = pinhole.error().text();
    }
    const auto table =
        call({realsense::Command::calibration_table, {realsense::kCoefficientsTable, 0, 0, 0}});
    const auto read = table ? realsense::coefficientsOf(*table, size) : std::unexpected(table.error());
    if (!read) {
      report.problem = read.error().text();
      if (const auto baseline_m = table ? realsense::baselineOf(*table) : std::unexpected(table.error())) {
        report.baseline_m = *baseline_m;
      }
      return;
    }
    report.baseline_m = read->baseline_m;
    if (!report.pinhole) report.pinhole = read->pinhole;
  }

  base::Result<realsense::DepthTable> depthTable() const {
    const auto data = call({realsense::Command::get_advanced, {realsense::kDepthTableGroup, 0, 0, 0}});
    return data ? realsense::depthTableFrom(*data) : std::unexpected(data.error());
  }

  base::Result<void> setDepthUnit(const config::CameraSettings& settings, CameraReport& report) const {
    auto table = depthTable();
    if (!table) {
      if (settings.unit_um > 0) return std::unexpected(table.error());
      report.problem = table.error().text();
      return {};
    }
    if (table->disparity_mode != 0) {
      return std::unexpected(failure("the camera delivers disparities instead of depth",
                                     "switch its disparity mode off, or unplug it and plug it in again"));
    }
    const double far_m = settings.far_m;
    const bool fine_reaches = far_m <= kMaxRaw * kFineUnit_um * 1e-6;
    const auto requested_um = settings.unit_um > 0 ? static_cast<std::uint32_t>(settings.unit_um)
                              : fine_reaches       ? static_cast<std::uint32_t>(kFineUnit_um)
                                                   : table->unit_um;
    if (requested_um != table->unit_um) {
      realsense::DepthTable changed = *table;
      changed.unit_um = requested_um;
      const auto set = call({realsense::Command::set_advanced,
                             {realsense::kDepthTableGroup, 0, 0, 0},
                             realsense::encoded(changed)});
      table = depthTable();  // what the camera made of it
      if (!table) return std::unexpected(table.error());
      if (settings.unit_um > 0 && table->unit_um != requested_um) {
        return std::unexpected(failure(fmt::format("the camera keeps its depth unit of {} um{}",
                                                   table->unit_um, set ? "" : ": " + set.error().text()),
                                       fmt::format("set camera.unit_um to {} or to 0", table->unit_um)));
      }
    }
    report.unit_m = table->unit_um * 1e-6;
    return {};
  }

  base::Result<void> setControls(const V4l2Settings& settings) const {
    constexpr std::uint8_t kEmitter = 2, kExposure = 3, kPreset = 6, kAutomaticExposure = 0xB;
    base::Result<void> done;
    if (settings.preset > 0) done = unit_.set(kPreset, oneByte(static_cast<unsigned>(settings.preset)));
    if (done && settings.emitter != Emitter::unchanged) {
      done = unit_.set(kEmitter, oneByte(static_cast<unsigned>(settings.emitter) - 1));
    }
    if (done && settings.exposure_us > 0) {
      done = unit_.set(kAutomaticExposure, oneByte(0));
      std::vector<std::byte> exposure;
      append(exposure, static_cast<std::uint32_t>(settings.exposure_us));
      if (done) done = unit_.set(kExposure, std::move(exposure));
    }
    if (done && settings.sync_role != SyncRole::unchanged) {
      const auto role = static_cast<std::uint32_t>(settings.sync_role) - 1;
      const auto set = call({realsense::Command::set_sync, {role, 0, 0, 0}});
      if (!set) return std::unexpected(set.error());
    }
    return done;
  }

  ExtensionUnit unit_;
};

class Gemini {
 public:
  explicit Gemini(const OpenDevice& device) : unit_(device) {}

  base::Result<CameraReport> prepare(const config::CameraSettings& settings) {
    CameraReport report;
    const auto version = structure(orbbec::kVersionStructure);
    if (version) {
      if (const auto read = orbbec::versionFrom(*version)) {
        report.firmware = read->firmware;
        report.serial = read->serial;
      }
    }
    const FrameSize size = sizeOf(settings);
    const auto cameras = list(orbbec::kCameraCalibrationList);
    if (!version && !cameras) {
      report.problem = version.error().text();
      return report;
    }
    const auto pinhole = cameras ? orbbec::pinholeOfMode(*cameras, size) : std::unexpected(cameras.error());
    if (pinhole) report.pinhole = *pinhole;
    if (!pinhole) report.problem = pinhole.error().text();
    const auto depths = list(orbbec::kDepthCalibrationList);
    if (const auto baseline_m = depths ? orbbec::baseline_mFrom(*depths) : std::unexpected(depths.error())) {
      report.baseline_m = *baseline_m;
    }
    if (auto unit = setDepthUnit(settings, report); !unit) return std::unexpected(unit.error());
    if (auto set = setControls(settings.of<V4l2Settings>()); !set) return std::unexpected(set.error());
    return report;
  }

 private:
  base::Result<std::vector<std::byte>> call(orbbec::Request request) {
    request.id = ++last_id_;
    const std::vector<std::byte> bytes = orbbec::encoded(request);
    if (auto sent = unit_.set(orbbec::selectorOf(bytes.size()), bytes); !sent) {
      return std::unexpected(sent.error());
    }
    const std::size_t expected = orbbec::responseBytes(request.operation);
    const auto response = unit_.get(orbbec::selectorOf(expected), expected);
    if (!response) return std::unexpected(response.error());
    return orbbec::responseData(request, *response);
  }

  base::Result<std::vector<std::byte>> structure(std::uint32_t property) {
    return call({orbbec::Operation::get_structure, 0, property});
  }

  base::Result<std::vector<std::byte>> list(std::uint32_t property) {
    const auto begun = call({orbbec::Operation::begin_list, 0, property});
    const auto size = begun ? orbbec::listSizeFrom(*begun) : std::unexpected(begun.error());
    if (!size) return std::unexpected(size.error());
    std::vector<std::byte> bytes;
    while (bytes.size() < size->bytes) {
      const auto offset = static_cast<std::uint32_t>(bytes.size());
      const std::uint32_t part = std::min(orbbec::kListPartBytes, size->bytes - offset);
      const auto read = call({orbbec::Operation::read_list, 0, property, {offset, part}});
      if (!read) return std::unexpected(read.error());
      if (read->size() < part) {
        return std::unexpected(failure(
            fmt::format("a list of the camera ends after {} of {} bytes", offset + read->size(), size->bytes),
            "update the camera's firmware"));
      }
      bytes.insert(bytes.end(), read->begin(), read->begin() + part);
    }
    if (auto ended = call({orbbec::Operation::end_list, 0, property}); !ended) {
      return std::unexpected(ended.error());
    }
    return bytes;
  }

  base::Result<double> depthUnit_m() {
    const auto data = call({orbbec::Operation::get_property, 0, orbbec::kDepthUnitProperty});
    return data ? orbbec::depthUnit_mFrom(*data) : std::unexpected(data.error());
  }

  base::Result<void> setDepthUnit(const config::CameraSettings& settings, CameraReport& report) {
    auto unit_m = depthUnit_m();
    const bool fine_reaches = settings.far_m <= kMaxRaw * kFineUnit_um * 1e-6;
    const double requested_um = settings.unit_um > 0 ? settings.unit_um : fine_reaches ? kFineUnit_um : 0;
    const auto isRequested = [&] { return unit_m && std::abs(*unit_m * 1e6 - requested_um) < 0.5; };
    if (requested_um > 0 && !isRequested()) {
      const auto unit_mm = static_cast<float>(requested_um / 1000);
      std::uint32_t word = 0;
      std::memcpy(&word, &unit_mm, sizeof word);
      static_cast<void>(call({orbbec::Operation::set_property, 0, orbbec::kDepthUnitProperty, {word}}));
      unit_m = depthUnit_m();  // what the camera made of it
    }
    if (settings.unit_um > 0 && !isRequested()) {
      return std::unexpected(failure(fmt::format("the camera refuses a depth unit of {} um", requested_um),
                                     "set camera.unit_um to 0"));
    }
    if (unit_m) report.unit_m = *unit_m;
    if (!unit_m) report.problem = unit_m.error().text();
    return {};
  }

  base::Result<void> setControls(const V4l2Settings& settings) {
    if (settings.exposure_us > 0 || settings.preset > 0 || settings.sync_role != SyncRole::unchanged) {
      return std::unexpected(
          failure("camera.exposure_us, camera.preset and camera.sync_role cannot be set on an Orbbec camera",
                  "remove them from the configuration, and set them with the vendor's viewer"));
    }
    if (settings.emitter == Emitter::unchanged) return {};
    const auto value = static_cast<std::uint32_t>(settings.emitter) - 1;
    const auto set = call({orbbec::Operation::set_property, 0, orbbec::kLaserProperty, {value}});
    return set ? base::Result<void>{} : std::unexpected(set.error());
  }

  ExtensionUnit unit_;
  std::uint16_t last_id_ = 0;
};

}  // namespace

base::Result<CameraReport> prepareCamera(const OpenDevice& device, std::uint16_t vendor,
                                         const config::CameraSettings& settings) {
  if (vendor == kRealSenseVendor) return RealSense(device).prepare(settings);
  if (vendor == kOrbbecVendor) return Gemini(device).prepare(settings);
  CameraReport report;
  report.problem = "the camera is of a vendor whose calibration cannot be read";
  return report;
}

std::optional<double> temperatureOf(const OpenDevice& device, std::uint16_t vendor) {
  return vendor == kRealSenseVendor ? RealSense(device).temperature() : std::nullopt;
}

base::Result<CompletedModel> completedModel(const config::CameraSettings& settings,
                                            const CameraReport& report, std::uint16_t vendor) {
  CompletedModel completed{settings.effectiveDepthModel(), {}};
  rt::DepthModelParameters& model = completed.model;
  const std::string reason = report.problem.empty() ? "" : ": " + report.problem;
  if (settings.intrinsics == config::IntrinsicsSource::camera) {
    if (!report.pinhole) {
      return std::unexpected(failure(fmt::format("the camera does not report intrinsics for {} x {}{}",
                                                 model.width_px, model.height_px, reason),
                                     "set camera.intrinsics to configured, and camera.fx_px, camera.fy_px, "
                                     "camera.cx_px and camera.cy_px "
                                     "to those of this mode"));
    }
    model.fx_px = report.pinhole->fx_px;
    model.fy_px = report.pinhole->fy_px;
    model.cx_px = report.pinhole->cx_px;
    model.cy_px = report.pinhole->cy_px;
  }
  if (report.unit_m) {
    model.unit_m = *report.unit_m;
  } else if (settings.unit_um == 0) {
    return std::unexpected(failure("the camera does not report its depth unit" + reason,
                                   "set camera.unit_um, to 1000 for a camera that delivers millimetres"));
  }
  if (!model.noise.isKnown() && report.baseline_m) {
    model.noise.c2_per_m = config::stereoNoise_per_m(model.fx_px, *report.baseline_m);
  }
  if (vendor == kOrbbecVendor && !report.baseline_m) model.principle = rt::DepthPrinciple::time_of_flight;
  if (!model.noise.isKnown()) {
    completed.advice = fmt::format(
        "the noise of this camera is not known{} (measure it with hapticctl camera test, and set "
        "camera.noise_c0_m, camera.noise_c1 and camera.noise_c2_per_m)",
        reason);
  } else if (settings.intrinsics == config::IntrinsicsSource::camera && !report.problem.empty()) {
    completed.advice = "a part of the camera's calibration cannot be used" + reason;
  }
  return completed;
}

}  // namespace hapticd::drivers
