// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/kinect/packed_recording.h"

#include <algorithm>
#include <memory>

#include "drivers/camera/kinect_image.h"
#include "drivers/camera/recorded/recording_reader.h"
#include "tests/support/kinect/depth_packets.h"

namespace hapticd::test {

static_assert(kinect::kPixels == drivers::kKinectPixels);

config::Result<PackedRecording> PackedRecording::load(const std::filesystem::path& folder,
                                                      std::size_t most_frames) {
  const auto reader = drivers::RecordingReader::open(folder);
  if (!reader) return std::unexpected(reader.error());
  const std::size_t frames = std::min(most_frames, reader->frames().size());
  const auto frame = std::make_unique<rt::DepthFrame>();
  PackedRecording recording;
  recording.packed_.resize(frames * kinect::kPackedFrameBytes);
  for (std::size_t index = 0; index < frames; ++index) {
    if (const auto read = reader->read(index, *frame); !read) return std::unexpected(read.error());
    kinect::packDepth(frame->image().first<drivers::kKinectPixels>(),
                      std::span(recording.packed_)
                          .subspan(index * kinect::kPackedFrameBytes)
                          .first<kinect::kPackedFrameBytes>());
  }
  return recording;
}

}  // namespace hapticd::test
