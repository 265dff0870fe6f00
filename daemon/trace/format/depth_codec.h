// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>

#include "daemon/trace/format/records.h"
#include "daemon/trace/mcap/mcap_format.h"
#include "rt/depth/depth_frame.h"

namespace hapticd::trace {

/// Lossless compression of raw depth images to messages.
///
/// A pixel usually differs little from the one above; after this prediction, small residuals remain in one
/// byte each, which suit zstd's entropy coding better than the pixels. Where nothing was measured, the
/// prediction continues with the last measurement above. An image that does not get shorter is stored
/// uncompressed.
/// Thread: one.  RT: not safe.
class DepthEncoder {
 public:
  /// Encodes an image. `image`: the stride_bytes * height_px bytes described by a valid header.
  void encode(const rt::DepthFrameHeader& header, std::span<const std::byte> image, DepthRecord& record);

 private:
  Compressor compressor_;
  std::string symbols_;
};

/// Decompresses depth images from messages, with reusable buffers.
/// Thread: one.  RT: not safe.
class DepthDecoder {
 public:
  /// Decodes to the bytes that were passed to encode(). Returns "" or a description of the record's fault,
  /// such as a checksum mismatch; `image` is then undefined.
  std::string decode(const DepthRecord& record, std::string& image);
  /// Decodes to a frame with its number, times and camera. A camera with a fault (rt::faultOf), with `near_m`
  /// and `far_m` of `frame`, or a raw value that it does not have is a fault here.
  std::string decode(const DepthRecord& record, rt::DepthFrame& frame);

 private:
  std::string symbols_;
  std::string image_;
};

/// Returns why a header cannot be used, e.g. "a depth frame of header version 7; ...", or "".
std::string depthHeaderFault(const rt::DepthFrameHeader& header);

/// Returns the header of a frame; `common`: the fields shared by all frames.
rt::DepthFrameHeader headerOf(const rt::DepthFrameHeader& common, const rt::DepthFrame& frame);

}  // namespace hapticd::trace
