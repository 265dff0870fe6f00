#include "drivers/camera/recorded/recording_writer.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <condition_variable>
#include <cstring>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "drivers/camera/recorded/depth_pgm.h"
#include "drivers/monotonic_clock.h"
#include "drivers/start_thread.h"

namespace hapticd::drivers {
namespace {

/// Frames between the camera and the disk: a quarter of a second.
constexpr std::size_t kFrames = 8;

config::Error diskError(const std::filesystem::path& where) {
  return {where.string(), fmt::format("cannot be written: {}", std::strerror(errno)), "check the disk"};
}

/// What a recording names the frame.
std::string nameOf(const rt::DepthFrame& frame, std::int64_t realtime_offset_ns) {
  const std::int64_t realtime_ns = frame.arrival_ns + realtime_offset_ns;
  return fmt::format("d-{}.{:09}-{}.pgm", realtime_ns / kNsPerSecond, realtime_ns % kNsPerSecond,
                     frame.device_ticks);
}

}  // namespace

class RecordingWriter::Implementation {
 public:
  Implementation(std::filesystem::path folder, int index, std::int64_t realtime_offset_ns)
      : folder_(std::move(folder)), index_(index), realtime_offset_ns_(realtime_offset_ns), frames_(kFrames) {
    for (std::size_t i = 0; i < kFrames; ++i) free_.push_back(i);
    waiting_.reserve(kFrames);
  }
  ~Implementation() {
    end();
    ::close(index_);
  }
  Implementation(const Implementation&) = delete;
  Implementation& operator=(const Implementation&) = delete;

  config::Result<void> start() {
    auto thread = startThread("hapticd-depth", [this] { run(); });
    if (!thread) return std::unexpected(thread.error());
    thread_ = std::move(*thread);
    return {};
  }

  bool offer(const rt::DepthFrame& frame) {
    std::size_t slot = 0;
    {
      const std::lock_guard lock(mutex_);
      if (free_.empty() || failure_) {
        lost_.fetch_add(1, std::memory_order_relaxed);
        return false;
      }
      slot = free_.back();
      free_.pop_back();
    }
    frames_[slot] = frame;
    {
      const std::lock_guard lock(mutex_);
      waiting_.push_back(slot);
    }
    wake_.notify_one();
    return true;
  }

  void end() {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    wake_.notify_one();
    if (thread_.joinable()) thread_.join();
  }

  std::uint64_t frames() const noexcept { return written_.load(std::memory_order_relaxed); }
  std::uint64_t lost() const noexcept { return lost_.load(std::memory_order_relaxed); }
  std::optional<config::Error> failure() const {
    const std::lock_guard lock(mutex_);
    return failure_;
  }

 private:
  void run() {
    std::unique_lock lock(mutex_);
    while (true) {
      wake_.wait(lock, [this] { return stop_ || !waiting_.empty(); });
      if (waiting_.empty()) return;
      const std::size_t slot = waiting_.front();
      waiting_.erase(waiting_.begin());
      const bool failed = failure_.has_value();
      lock.unlock();
      const auto written = failed ? config::Result<void>{} : write(frames_[slot]);
      lock.lock();
      free_.push_back(slot);
      if (!written) failure_ = written.error();
      (written && !failed ? written_ : lost_).fetch_add(1, std::memory_order_relaxed);
    }
  }

  /// The image first, then its line: whoever reads the index finds what it names.
  config::Result<void> write(const rt::DepthFrame& frame) {
    const std::string name = nameOf(frame, realtime_offset_ns_);
    if (auto image = writeDepthPgm(folder_ / name, frame); !image) return image;
    const std::string line = name + "\n";
    if (::write(index_, line.data(), line.size()) != static_cast<ssize_t>(line.size())) {
      auto error = diskError(folder_ / "INDEX.txt");
      (void)::ftruncate(index_, index_bytes_);  // half a line would make the index unreadable
      return std::unexpected(std::move(error));
    }
    index_bytes_ += static_cast<off_t>(line.size());
    return {};
  }

  const std::filesystem::path folder_;
  const int index_;
  const std::int64_t realtime_offset_ns_;
  off_t index_bytes_ = 0;  // of whole lines; the writing thread only
  std::vector<rt::DepthFrame> frames_;
  mutable std::mutex mutex_;  // of the next five
  std::condition_variable wake_;
  std::vector<std::size_t> free_;
  std::vector<std::size_t> waiting_;  // the oldest first
  std::optional<config::Error> failure_;
  bool stop_ = false;
  std::atomic<std::uint64_t> written_{0};  // relaxed: they order nothing
  std::atomic<std::uint64_t> lost_{0};
  std::thread thread_;
};

config::Result<std::unique_ptr<RecordingWriter>> RecordingWriter::create(const std::filesystem::path& folder,
                                                                         std::int64_t realtime_offset_ns) {
  std::error_code failure;
  if (!std::filesystem::create_directory(folder, failure)) {
    return std::unexpected(config::Error{folder.string(),
                                         failure ? "cannot be made: " + failure.message() : "exists already",
                                         "name a new folder in one that can be written"});
  }
  const std::filesystem::path file = folder / "INDEX.txt";
  const int index = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, 0666);
  if (index < 0) return std::unexpected(diskError(file));
  auto implementation = std::make_unique<Implementation>(folder, index, realtime_offset_ns);
  if (auto started = implementation->start(); !started) return std::unexpected(started.error());
  return std::unique_ptr<RecordingWriter>(new RecordingWriter(std::move(implementation)));
}

RecordingWriter::RecordingWriter(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}

RecordingWriter::~RecordingWriter() = default;

bool RecordingWriter::offer(const rt::DepthFrame& frame) {
  return implementation_->offer(frame);
}

config::Result<void> RecordingWriter::close() {
  implementation_->end();
  if (auto failed = implementation_->failure()) return std::unexpected(*failed);
  return {};
}

std::uint64_t RecordingWriter::frames() const noexcept {
  return implementation_->frames();
}

std::uint64_t RecordingWriter::lost() const noexcept {
  return implementation_->lost();
}

std::optional<config::Error> RecordingWriter::failure() const {
  return implementation_->failure();
}

}  // namespace hapticd::drivers
