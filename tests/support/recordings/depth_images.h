// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "rt/depth/depth_frame.h"

namespace hapticd::test {

/// Returns the pixels of a frame without the padding of its rows.
std::vector<std::uint16_t> pixelsOf(const rt::DepthFrame& frame);

/// Returns a PNG image with 16 bits of grey.
std::string greyPng(int width_px, int height_px, const std::vector<std::uint16_t>& pixels);
/// Returns such an image that is also full of texts of that length, compressed as PNG allows.
std::string greyPngWithTexts(int width_px, int height_px, const std::vector<std::uint16_t>& pixels, int texts,
                             std::size_t bytes_of_text);
/// Returns a PNG image with 8 bits of grey, or of each of three colours.
std::string bytePng(int width_px, int height_px, bool colour = false);
/// Returns a PGM image of 16 bits, the more significant byte first.
std::string bigEndianPgm(int width_px, int height_px, const std::vector<std::uint16_t>& pixels);

/// Returns the 640 x 480 raw values of a file with a header of one line and little-endian pixels.
std::vector<std::uint16_t> rawPixelsOf(const std::filesystem::path& file);

}  // namespace hapticd::test
