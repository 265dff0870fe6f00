// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "config/base/error.h"
#include "rt/base/vec3.h"

/// What the readers of this folder share: the patient's frame, bytes of files, numbers in them.
namespace hapticd::solids {

/// The axes of a patient's frame. lps: x to the left, y to the back (posterior), z to the head (superior), as
/// in DICOM and in files of 3D Slicer. ras: x to the right, y to the front (anterior), z to the head.
enum class Frame { lps, ras };

/// How a property of a file was determined.
enum class KnownFrom {
  file,     ///< the file states it
  option,   ///< the caller states it
  assumed,  ///< neither does
};

std::string_view textOf(Frame frame);          ///< "LPS", "RAS"
std::string_view textOf(KnownFrom knowledge);  ///< "stated in the file", "given", "assumed"

/// The warning about an option in vain.
std::string ignoredFrame(Frame stated, Frame given);

/// The frame of "LPS" or "RAS", in small letters or capitals; nothing for other words.
std::optional<Frame> frameOf(std::string_view word);

/// A point or direction of `frame` in LPS.
constexpr rt::Vec3 inLps(const rt::Vec3& vector, Frame frame) noexcept {
  return frame == Frame::ras ? rt::Vec3{-vector.x, -vector.y, vector.z} : vector;
}

constexpr double kMetresPerMillimetre = 1e-3;
/// Coordinates above this are not of a patient, in any unit.
constexpr double kMaxCoordinate = 1e9;

// What reading a file may take at most, whatever it contains; all readers of shapes take it from here. It is
// limited by the bytes of the file, so that a small file can neither fill nor stop a computer.

/// Bytes of memory for a file of so many bytes.
constexpr std::uint64_t mostMemory(std::uint64_t file_bytes) {
  return (std::uint64_t{64} << 20) + 256 * file_bytes;
}
/// Steps of loops whose number is not proportional to the bytes, each of some nanoseconds.
constexpr std::uint64_t mostSteps(std::uint64_t file_bytes) {
  return 1'000'000'000 + 1000 * file_bytes;
}

/// "(1.0, -2.5, 3.0) mm" of a point in metres.
std::string millimetreText(const rt::Vec3& point_m);

/// Returns an error for `return`.
std::unexpected<base::Error> refused(std::string where, std::string what, std::string remedy);

/// Reads a whole regular file.  Errors: unreadable, not a regular file, longer than `longest` bytes.
base::Result<std::string> contentOf(const std::filesystem::path& file, std::size_t longest);

/// Returns the number at `bytes`, which has the byte order `order`.
template <typename Number>
Number numberAt(const char* bytes, std::endian order) {
  char copy[sizeof(Number)];
  for (std::size_t i = 0; i < sizeof(Number); ++i)
    copy[i] = bytes[order == std::endian::native ? i : sizeof(Number) - 1 - i];
  Number number;
  std::memcpy(&number, copy, sizeof(Number));
  return number;
}

/// Returns a decimal number; a leading plus sign and a decimal comma are accepted, as some programs write
/// them. Nothing for other text, and for numbers beyond kMaxCoordinate or not finite.
std::optional<double> coordinateFrom(std::string_view text);

/// Returns `text` without white space at both ends.
std::string_view trimmed(std::string_view text);
std::string lowerCase(std::string_view text);

/// Walks through the lines of a text, and through the words of each, behind a byte-order mark. Lines end as
/// the first one does: in LF, CRLF or CR.
class TextCursor {
 public:
  explicit TextCursor(std::string_view text);
  /// Returns the next line without its end; nothing behind the last one.
  std::optional<std::string_view> nextLine();
  /// Returns the next word, in whichever line it stands; nothing at the end.
  std::optional<std::string_view> nextWord();
  /// Returns what is left of the line of the last word, and goes to the next line.
  std::string_view restOfLine();
  std::size_t line() const { return line_; }  ///< number of the line of what was last returned, from 1
  std::size_t at() const { return at_; }      ///< offset of what comes next

 private:
  std::string_view text_;
  char line_end_ = '\n';
  std::size_t at_ = 0;
  std::size_t line_ = 0;
  std::size_t line_ends_passed_ = 0;
};

/// Returns the first word of `text`, and takes it and the white space around it off; empty at the end.
std::string_view takeWord(std::string_view& text);

/// Bytes one piece after the other: as they are, or of a gzip stream of one member or more. Decompressing
/// takes no memory beyond the piece.
class ByteStream {
 public:
  /// `bytes` must outlive it. `name`: of the file, for messages.
  ByteStream(std::string_view bytes, bool is_gzip, const std::string& name);
  ~ByteStream();

  /// Returns how many bytes it put into `room`: fewer than fit only where the stream ends, whose checksum is
  /// right then. Errors: not gzip, damaged, truncated.
  base::Result<std::size_t> read(std::span<char> room);

 private:
  struct Gzip;

  std::string_view bytes_;  ///< not yet taken
  std::size_t size_;
  std::string name_;
  std::unique_ptr<Gzip> gzip_;
};

}  // namespace hapticd::solids
