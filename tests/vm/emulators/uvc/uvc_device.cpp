// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/uvc/uvc_device.h"

#include <fmt/format.h>
#include <linux/usb/ch9.h>
#include <linux/usb/video.h>

#include "tests/vm/emulators/usbip/control_socket.h"
#include "tests/vm/emulators/uvc/depth_stream.h"
#include "tests/vm/emulators/uvc/uvc_descriptors.h"

namespace hapticd::test::uvc {
namespace {

using usbip::ControlAnswer;

// of the control that tells why a request was refused
constexpr std::uint8_t kOutOfRange = 0x04;
constexpr std::uint8_t kInvalidUnit = 0x05;
constexpr std::uint8_t kInvalidControl = 0x06;
constexpr std::uint8_t kInvalidRequest = 0x07;

std::unique_ptr<ExtensionUnit> unitOf(const CameraModel& model, const Faults& faults) {
  return model.protocol == Protocol::orbbec ? orbbecUnit(model, faults) : realsenseUnit(model, faults);
}

std::string sizeOf(const DepthMode& mode) {
  return fmt::format("{}x{}", mode.width_px, mode.height_px);
}

}  // namespace

UvcDevice::UvcDevice(CameraModel model, usbip::Log log)
    : full_model_(std::move(model)),
      model_(full_model_),
      log_(std::move(log)),
      unit_(unitOf(model_, faults_)),
      negotiation_(model_, payloadHeaderBytes(model_)),
      stream_(model_, faults_) {
  reset();
}

/// Faults of descriptors and another choice of modes begin here: it is plugged in.
void UvcDevice::reset() {
  stream_.stop();
  model_.modes.clear();
  for (const DepthMode& mode : full_model_.modes) {
    if (offered_ == "all" || offered_ == sizeOf(mode)) model_.modes.push_back(mode);
  }
  unit_ = unitOf(model_, faults_);
  negotiation_.reset();
  negotiation_.lieAboutSize(faults_.has(Fault::lies_about_size));
  descriptors_ = describeCamera(model_, unit_->selectors(), faults_);
}

bool UvcDevice::answers(const usbip::SetupPacket& setup) const {
  const bool own = (setup.request_type & USB_TYPE_MASK) == USB_TYPE_CLASS;
  return !own || !faults_.has(Fault::mute);
}

ControlAnswer UvcDevice::control(const usbip::SetupPacket& setup, std::span<const std::uint8_t> data) {
  const bool own =
      (setup.request_type & (USB_TYPE_MASK | USB_RECIP_MASK)) == (USB_TYPE_CLASS | USB_RECIP_INTERFACE);
  if (!own) return ControlAnswer::stall();
  const auto interface = static_cast<std::uint8_t>(setup.index & 0xff);
  const auto entity = static_cast<std::uint8_t>(setup.index >> 8);
  const auto selector = static_cast<std::uint8_t>(setup.value >> 8);
  if (interface == kStreamingInterface) return streaming(setup, data);
  if (interface != kControlInterface) return refuse(kInvalidUnit);
  if (entity == kExtensionUnit) return extension(setup, data);
  if (entity == 0 && selector == UVC_VC_REQUEST_ERROR_CODE_CONTROL && setup.request == UVC_GET_CUR) {
    return reply({error_code_});
  }
  return refuse(entity == 0 ? kInvalidControl : kInvalidUnit);
}

ControlAnswer UvcDevice::streaming(const usbip::SetupPacket& setup, std::span<const std::uint8_t> data) {
  const auto selector = static_cast<std::uint8_t>(setup.value >> 8);
  if (setup.request != UVC_SET_CUR) {
    const auto answer = negotiation_.get(selector, setup.request);
    return answer ? reply(Bytes(answer->begin(), answer->end())) : refuse(kInvalidRequest);
  }
  if (!negotiation_.set(selector, data)) return refuse(kInvalidControl);
  if (selector == UVC_VS_COMMIT_CONTROL) {
    const StreamMode& stream = *negotiation_.committed();
    stream_.start(stream, unit_->depthUnit_um());
    log_(fmt::format("stream of {} begins, {} us between frames", sizeOf(model_.modes[stream.mode]),
                     stream.interval_100ns / 10));
  }
  return ControlAnswer::done();
}

ControlAnswer UvcDevice::extension(const usbip::SetupPacket& setup, std::span<const std::uint8_t> data) {
  const auto selector = static_cast<std::uint8_t>(setup.value >> 8);
  const std::size_t length = unit_->length(selector);
  if (length == 0 || faults_.has(Fault::unit_stalls)) return refuse(kInvalidControl);
  switch (setup.request) {
    case UVC_SET_CUR:
      if (data.size() != length) return refuse(kOutOfRange);
      return unit_->set(selector, data) ? ControlAnswer::done() : refuse(kOutOfRange);
    case UVC_GET_LEN: {
      const auto told = static_cast<std::uint16_t>(faults_.has(Fault::unit_length) ? 7 : length);
      return reply({static_cast<std::uint8_t>(told & 0xff), static_cast<std::uint8_t>(told >> 8)});
    }
    case UVC_GET_INFO:
      return reply({UVC_CONTROL_CAP_GET | UVC_CONTROL_CAP_SET});
    default: {
      auto value = unit_->get(selector, setup.request);
      return value ? reply(std::move(*value)) : refuse(kInvalidRequest);
    }
  }
}

ControlAnswer UvcDevice::reply(Bytes bytes) {
  reply_ = std::move(bytes);
  return ControlAnswer::done(reply_);
}

ControlAnswer UvcDevice::refuse(std::uint8_t error_code) {
  error_code_ = error_code;
  return ControlAnswer::stall();
}

/// The class has no request that ends a stream over a bulk endpoint; hosts do it by this one.
void UvcDevice::clearHalt(std::uint8_t endpoint) {
  if (endpoint != kStreamEndpoint || !stream_.isStreaming()) return;
  log_(fmt::format("stream ends after {} frames, {} skipped", stream_.framesSent(), stream_.framesSkipped()));
  stream_.stop();
}

std::optional<std::int64_t> UvcDevice::due_ns(const usbip::PendingUrbs& /*urbs*/) const {
  return stream_.due_ns();
}

std::string UvcDevice::command(std::string_view line) {
  if (const auto arguments = usbip::argumentsOf(line, "fault")) return setFault(*arguments);
  if (const auto argument = usbip::argumentsOf(line, "freeze")) return freeze(*argument);
  if (const auto argument = usbip::argumentsOf(line, "modes")) return offerModes(*argument);
  if (line == "play") {
    stream_.freeze(std::nullopt);
  } else if (line == "resume") {
    faults_.clear();
  } else {
    return fmt::format("error: unknown command \"{}\"", line);
  }
  return "ok";
}

std::string UvcDevice::setFault(std::string_view arguments) {
  constexpr std::string_view kOnce = " once";
  const bool once = arguments.ends_with(kOnce);
  const auto fault = faultNamed(once ? arguments.substr(0, arguments.size() - kOnce.size()) : arguments);
  if (!fault) return fmt::format("error: there is no fault \"{}\"", arguments);
  if (!once) {
    faults_.set(*fault);
    return "ok";
  }
  if (*fault > Fault::frame_repeated) {
    return fmt::format("error: \"{}\" is no fault of a single frame", arguments);
  }
  stream_.spoilOnce(*fault);
  return "ok";
}

std::string UvcDevice::freeze(std::string_view argument) {
  const auto frame = usbip::wholeNumber(argument);
  if (!frame || *frame >= DepthScene::kPhases) {
    return fmt::format("error: there is no frame \"{}\", there are 0 to {}", argument,
                       DepthScene::kPhases - 1);
  }
  stream_.freeze(*frame);
  return "ok";
}

std::string UvcDevice::offerModes(std::string_view argument) {
  std::string sizes;
  for (const DepthMode& mode : full_model_.modes) {
    if (argument == sizeOf(mode) || argument == "all") {
      offered_ = argument;
      return "ok";
    }
    sizes += ", " + sizeOf(mode);
  }
  return fmt::format("error: there is no mode \"{}\", there are all{}", argument, sizes);
}

std::string UvcDevice::commands() const {
  std::string names;
  for (const std::string_view fault : kFaultNames) names += (names.empty() ? "" : "|") + std::string(fault);
  return fmt::format(
      "freeze FRAME, play, modes all, modes WxH, resume, fault NAME, fault NAME once with NAME {}", names);
}

std::string UvcDevice::status() const {
  const auto& stream = negotiation_.committed();
  return fmt::format(R"("streaming":{},"mode":"{}","interval_us":{},"frames":{},"skipped":{},"spoilt":{},)"
                     R"("depth_unit_um":{})",
                     stream_.isStreaming(), stream ? sizeOf(model_.modes[stream->mode]) : "",
                     stream ? stream->interval_100ns / 10 : 0, stream_.framesSent(), stream_.framesSkipped(),
                     stream_.framesSpoilt(), unit_->depthUnit_um());
}

}  // namespace hapticd::test::uvc
