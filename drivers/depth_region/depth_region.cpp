// SPDX-License-Identifier: Apache-2.0
#include "drivers/depth_region/depth_region.h"

#include <fcntl.h>
#include <linux/futex.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <cstring>
#include <ctime>
#include <new>
#include <string>
#include <utility>

namespace hapticd::drivers {
namespace {

constexpr std::size_t kWord = sizeof(std::uint64_t);
constexpr std::size_t kUnit = 4096;  // of the places of the slots; nothing depends on the size of a page
constexpr std::size_t kHeaderOffset = kWord;
constexpr std::size_t kImageOffset = 320;  // a multiple of a cache line, behind counter and header
static_assert(kHeaderOffset + sizeof(rt::DepthFrameHeader) <= kImageOffset);
static_assert(sizeof(rt::DepthFrameHeader) % kWord == 0);
constexpr int kAttempts = 4;
constexpr const char* kWhere = "depth region";

constexpr std::size_t roundUp(std::size_t bytes, std::size_t unit) {
  return (bytes + unit - 1) / unit * unit;
}

base::Error systemError(const std::string& what) {
  return {kWhere, what + ": " + std::strerror(errno), "look for exhausted memory, and limits of the service"};
}

std::uint64_t& wordAt(std::byte* begin, std::size_t word) {
  return reinterpret_cast<std::uint64_t*>(begin)[word];
}

// Both processes touch the words of a slot at the same time; atomic words make that defined, and the counter
// says whether the result is one frame.

void storeWord(std::byte* to, std::size_t word, std::span<const std::byte> bytes) {
  std::uint64_t value = 0;
  std::memcpy(&value, bytes.data(), bytes.size());
  std::atomic_ref(wordAt(to, word)).store(value, std::memory_order_relaxed);
}

void storeWords(std::byte* to, std::span<const std::byte> bytes) {
  const std::size_t whole = bytes.size() / kWord;
  for (std::size_t word = 0; word < whole; ++word) storeWord(to, word, bytes.subspan(word * kWord, kWord));
  if (whole * kWord != bytes.size()) storeWord(to, whole, bytes.subspan(whole * kWord));
}

/// The load is an acquire, so that the counter is read again after it.
void loadWord(std::span<std::byte> to, std::byte* from, std::size_t word) {
  const std::uint64_t value = std::atomic_ref(wordAt(from, word)).load(std::memory_order_acquire);
  std::memcpy(to.data(), &value, to.size());
}

void loadWords(std::span<std::byte> to, std::byte* from) {
  const std::size_t whole = to.size() / kWord;
  for (std::size_t word = 0; word < whole; ++word) loadWord(to.subspan(word * kWord, kWord), from, word);
  if (whole * kWord != to.size()) loadWord(to.subspan(whole * kWord), from, whole);
}

std::atomic_ref<std::uint64_t> counterOf(std::byte* slot) {
  return std::atomic_ref(wordAt(slot, 0));
}

std::size_t imageBytes(const rt::DepthFrameHeader& header) {
  return std::size_t{header.stride_bytes} * header.height_px;
}

base::Result<std::unique_ptr<DepthRegionMapping>> map(int descriptor, std::size_t bytes, int protection) {
  void* const mapped = ::mmap(nullptr, bytes, protection, MAP_SHARED, descriptor, 0);
  if (mapped == MAP_FAILED) return std::unexpected(systemError("its memory cannot be mapped"));
  return std::make_unique<DepthRegionMapping>(static_cast<std::byte*>(mapped), bytes);
}

void wakeAll(std::atomic<std::uint32_t>& futex) {
  futex.fetch_add(1, std::memory_order_release);
  ::syscall(SYS_futex, &futex, FUTEX_WAKE, INT_MAX, nullptr, nullptr, 0);
}

}  // namespace

DepthRegionMapping::~DepthRegionMapping() {
  ::munmap(begin, bytes);
}

base::Result<std::unique_ptr<DepthRegionWriter>> DepthRegionWriter::create(std::size_t image_bytes) {
  const std::size_t slot_bytes = roundUp(kImageOffset + image_bytes, kUnit);
  const std::size_t bytes = kUnit + kSlots * slot_bytes;
  base::Descriptor memory(::memfd_create("hapticd-depth", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  if (!memory || ::ftruncate(memory.get(), static_cast<off_t>(bytes)) != 0)
    return std::unexpected(systemError("no memory file"));
  auto mapping = map(memory.get(), bytes, PROT_READ | PROT_WRITE);
  if (!mapping) return std::unexpected(mapping.error());
  // The mapping above stays writable; nobody can make another one that is.
  constexpr int kSeals = F_SEAL_GROW | F_SEAL_SHRINK | F_SEAL_FUTURE_WRITE | F_SEAL_SEAL;
  if (::fcntl(memory.get(), F_ADD_SEALS, kSeals) != 0)
    return std::unexpected(systemError("the memory file cannot be sealed"));

  auto* const head = new ((*mapping)->begin) DepthRegionHead;
  head->slots = kSlots;
  head->first_slot = kUnit;
  head->slot_bytes = slot_bytes;
  head->image_offset = kImageOffset;
  return std::unique_ptr<DepthRegionWriter>(new DepthRegionWriter(std::move(memory), std::move(*mapping)));
}

DepthRegionWriter::~DepthRegionWriter() {
  head().closed.store(1, std::memory_order_relaxed);
  wakeAll(head().changes);
}

DepthRegionHead& DepthRegionWriter::head() const noexcept {
  return *std::launder(reinterpret_cast<DepthRegionHead*>(mapping_->begin));
}

void DepthRegionWriter::publish(const rt::DepthFrameHeader& header,
                                std::span<const std::byte> image) noexcept {
  DepthRegionHead& head = this->head();
  if (image.size() > head.slot_bytes - head.image_offset) return;
  // DepthRegionHead::kNone + 1 is slot 0.
  const std::uint32_t slot = (head.newest.load(std::memory_order_relaxed) + 1) % kSlots;
  std::byte* const begin = mapping_->begin + head.first_slot + slot * head.slot_bytes;
  // acquire: no store to the slot comes before the counter is odd
  counterOf(begin).fetch_add(1, std::memory_order_acq_rel);
  storeWords(begin + kHeaderOffset, std::as_bytes(std::span(&header, 1)));
  storeWords(begin + kImageOffset, image);
  counterOf(begin).fetch_add(1, std::memory_order_release);
  head.newest.store(slot, std::memory_order_release);
  wakeAll(head.changes);
}

base::Result<DepthRegionReader> DepthRegionReader::open(const base::Descriptor& memory) {
  const auto bad = [](std::string what) {
    return std::unexpected(
        base::Error{kWhere, std::move(what), "use a reader and a hapticd of the same version"});
  };
  struct stat status {};
  if (::fstat(memory.get(), &status) != 0) return std::unexpected(systemError("it cannot be examined"));
  const auto bytes = static_cast<std::size_t>(status.st_size);
  if (bytes < sizeof(DepthRegionHead)) return bad("it is too short");
  // Memory that shrinks would end this process at its next access.
  if ((::fcntl(memory.get(), F_GET_SEALS) & F_SEAL_SHRINK) == 0) return bad("it is not sealed");
  auto mapping = map(memory.get(), bytes, PROT_READ);
  if (!mapping) return std::unexpected(mapping.error());

  DepthRegionReader reader(std::move(*mapping));
  const DepthRegionHead& head = reader.head();
  if (head.magic != DepthRegionHead::kMagic) return bad("it does not begin as one");
  if (head.version != DepthRegionHead::kVersion)
    return bad("it has version " + std::to_string(head.version) + ", not 1");
  reader.slots_ = head.slots;
  reader.first_slot_ = head.first_slot;
  reader.slot_bytes_ = head.slot_bytes;
  reader.image_offset_ = head.image_offset;
  const bool fits = reader.first_slot_ <= bytes && reader.slots_ > 0 && reader.slot_bytes_ > 0 &&
                    (bytes - reader.first_slot_) / reader.slot_bytes_ >= reader.slots_ &&
                    reader.image_offset_ >= kHeaderOffset + sizeof(rt::DepthFrameHeader) &&
                    reader.image_offset_ <= reader.slot_bytes_ &&
                    (reader.first_slot_ | reader.slot_bytes_ | reader.image_offset_) % kWord == 0;
  if (!fits) return bad("its sizes contradict each other");
  return reader;
}

const DepthRegionHead& DepthRegionReader::head() const noexcept {
  return *std::launder(reinterpret_cast<const DepthRegionHead*>(mapping_->begin));
}

std::uint32_t DepthRegionReader::changes() const noexcept {
  return head().changes.load(std::memory_order_acquire);
}

bool DepthRegionReader::closed() const noexcept {
  return head().closed.load(std::memory_order_acquire) != 0;
}

bool DepthRegionReader::wait(std::uint32_t seen, std::chrono::milliseconds limit) const {
  const auto deadline = std::chrono::steady_clock::now() + limit;
  while (changes() == seen) {
    const auto left =
        std::chrono::duration_cast<std::chrono::nanoseconds>(deadline - std::chrono::steady_clock::now());
    if (left.count() <= 0) return false;
    const timespec patience{left.count() / 1'000'000'000, left.count() % 1'000'000'000};
    ::syscall(SYS_futex, &head().changes, FUTEX_WAIT, seen, &patience, nullptr, 0);
  }
  return true;
}

bool DepthRegionReader::read(rt::DepthFrameHeader& header, std::vector<std::byte>& image) const {
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    const std::uint32_t newest = head().newest.load(std::memory_order_acquire);
    if (newest >= slots_) return false;
    if (readSlot(newest, header, image)) return true;
  }
  return false;
}

bool DepthRegionReader::readSlot(std::uint32_t slot, rt::DepthFrameHeader& header,
                                 std::vector<std::byte>& image) const {
  std::byte* const begin = mapping_->begin + first_slot_ + slot * slot_bytes_;
  const std::uint64_t before = counterOf(begin).load(std::memory_order_acquire);
  if (before % 2 != 0) return false;
  loadWords(std::as_writable_bytes(std::span(&header, 1)), begin + kHeaderOffset);
  if (rt::faultOf(header) != rt::DepthHeaderFault::none) return false;
  if (imageBytes(header) > slot_bytes_ - image_offset_) return false;
  image.resize(imageBytes(header));
  loadWords(image, begin + image_offset_);
  return counterOf(begin).load(std::memory_order_relaxed) == before;
}

}  // namespace hapticd::drivers
