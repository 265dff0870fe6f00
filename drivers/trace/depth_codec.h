// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include "drivers/trace/compression.h"
#include "drivers/trace/records.h"
#include "rt/depth_frame.h"

namespace hapticd::drivers {

/// Raw depth images into messages and back, bit by bit the same.
///
/// A pixel mostly differs little from the one above; what is left after that prediction are small numbers in
/// one byte each, which zstd's entropy coding likes better than the pixels. Where nothing was measured the
/// prediction goes on with what was measured above. An image that does not get shorter is kept as it is.
/// Thread: one.  RT: not safe.
class DepthEncoder {
 public:
  /// `image`: the stride_bytes * height_px bytes of a header without fault.
  void encode(const rt::DepthFrameHeader& header, std::span<const std::byte> image, DepthRecord& record);

 private:
  Compressor compressor_;
  std::string symbols_;
};

/// Takes images out of messages, with buffers that are kept.
/// Thread: one.  RT: not safe.
class DepthDecoder {
 public:
  /// `image`: the bytes that encode() got. What is wrong with the record, or "": also a checksum that does
  /// not fit; then `image` is undefined.
  std::string decode(const DepthRecord& record, std::string& image);
  /// The same into a frame of the Kinect v1's size, with its number and times. A frame of another size, or a
  /// raw value above 2047, is wrong here.
  std::string decode(const DepthRecord& record, rt::DepthFrame& frame);

 private:
  std::string symbols_;
  std::string image_;
};

/// Why a header cannot be used, as "a depth frame of header version 7; ...", or "".
std::string depthHeaderFault(const rt::DepthFrameHeader& header);

/// The header of a Kinect v1's frame; `common`: what its frames have in common.
rt::DepthFrameHeader headerOf(const rt::DepthFrameHeader& common, const rt::DepthFrame& frame);

}  // namespace hapticd::drivers
