// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "config/error.h"
#include "tests/vm/emulators/uvc/depth_scene.h"

namespace hapticd::test::uvc {

/// Where the pixels of the frames come from.  Thread: one.
class FrameSource {
 public:
  FrameSource() = default;
  FrameSource(const FrameSource&) = delete;
  FrameSource& operator=(const FrameSource&) = delete;
  virtual ~FrameSource() = default;

  /// Announces the size and the depth unit of the frames from now on.
  virtual void begin(const DepthMode& mode, const Intrinsics& intrinsics, std::uint32_t unit_um) = 0;
  /// Writes frame `number` of the announced size.
  virtual void write(std::uint32_t number, std::span<std::uint16_t> frame) = 0;
  /// How many different frames there are; they repeat after that.
  virtual std::uint32_t frames() const = 0;
};

/// Frames of DepthScene.
class SceneFrames final : public FrameSource {
 public:
  void begin(const DepthMode& mode, const Intrinsics& intrinsics, std::uint32_t unit_um) override;
  void write(std::uint32_t number, std::span<std::uint16_t> frame) override { scene_->write(number, frame); }
  std::uint32_t frames() const override { return DepthScene::kPhases; }

 private:
  std::unique_ptr<DepthScene> scene_;
};

/// Frames of a folder, in the order of their names, as they are; of another size than the stream's, they are
/// cut, and pixels outside of them are 0.
class FolderFrames final : public FrameSource {
 public:
  /// Loads at most `most_frames` PGM images (P5) of 16 bits and equal size. big_endian: as the PGM standard
  /// has them; else as libfreenect writes them.
  /// Errors: no images, not such images, different sizes.
  static config::Result<std::unique_ptr<FolderFrames>> load(const std::filesystem::path& folder,
                                                            std::size_t most_frames, bool big_endian);

  void begin(const DepthMode& mode, const Intrinsics& intrinsics, std::uint32_t unit_um) override;
  void write(std::uint32_t number, std::span<std::uint16_t> frame) override;
  std::uint32_t frames() const override { return static_cast<std::uint32_t>(images_.size()); }

 private:
  std::size_t width_px_ = 0;
  std::size_t height_px_ = 0;
  std::size_t stream_width_px_ = 0;
  std::vector<std::vector<std::uint16_t>> images_;
};

}  // namespace hapticd::test::uvc
