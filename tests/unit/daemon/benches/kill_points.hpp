#pragma once
// A campaign in a child process that dies at its n-th write to the campaign file. The writes (the
// main file, its log and other files of SQLite) are counted by a file system layer of the child.
// The program under test has no part of it. Linux only.

#include <signal.h>
#include <sqlite3.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <limits>

#include "daemon/campaign/campaign.hpp"

namespace weft::daemon::test {

/// The interval of writes for a test that kills at every write: 1 in the nightly preset, else 3.
inline std::uint64_t writes_between_kills() {
  return std::getenv("WEFT_EVERY_WRITE") != nullptr ? 1 : 3;
}

/// The write that ends the process, and whether half of it reaches the file.
struct KillPoint {
  std::uint64_t write = 0;  ///< from 1; 0: never
  bool torn = false;
  /// Counting starts when this number of trials is recorded, because the number of writes of a
  /// trial depends on the speed of the machine.
  std::size_t after_trials = 0;
};

namespace killing {

inline constexpr std::uint64_t never = std::numeric_limits<std::uint64_t>::max();
inline bool torn = false;
inline std::atomic<std::uint64_t> writes_left = never;  ///< over all threads
inline sqlite3_vfs* below = nullptr;
inline void (*synced)(const char* file) = nullptr;  ///< called after a file is on the disk

/// SQLite's handle; the real one lies behind it.
struct File {
  sqlite3_file base;
  const char* name;
  sqlite3_file* real() { return reinterpret_cast<sqlite3_file*>(this + 1); }
};
inline sqlite3_file* real(sqlite3_file* file) {
  return reinterpret_cast<File*>(file)->real();
}

/// True for the last write: the process then ends, perhaps after half of it.
inline bool is_last() {
  return --writes_left == 0;
}
inline void die() {
  raise(SIGKILL);
}

inline int write(sqlite3_file* file, const void* bytes, int count, sqlite3_int64 at) {
  if (is_last()) {
    if (torn) real(file)->pMethods->xWrite(real(file), bytes, count / 2, at);
    die();
  }
  return real(file)->pMethods->xWrite(real(file), bytes, count, at);
}
inline int truncate(sqlite3_file* file, sqlite3_int64 size) {
  if (is_last()) die();
  return real(file)->pMethods->xTruncate(real(file), size);
}
inline int close(sqlite3_file* f) {
  return real(f)->pMethods->xClose(real(f));
}
inline int read(sqlite3_file* f, void* to, int n, sqlite3_int64 at) {
  return real(f)->pMethods->xRead(real(f), to, n, at);
}
inline int sync(sqlite3_file* f, int flags) {
  const int done = real(f)->pMethods->xSync(real(f), flags);
  const char* const name = reinterpret_cast<File*>(f)->name;
  if (done == SQLITE_OK && synced != nullptr && name != nullptr) synced(name);
  return done;
}
inline int size(sqlite3_file* f, sqlite3_int64* n) {
  return real(f)->pMethods->xFileSize(real(f), n);
}
inline int lock(sqlite3_file* f, int l) {
  return real(f)->pMethods->xLock(real(f), l);
}
inline int unlock(sqlite3_file* f, int l) {
  return real(f)->pMethods->xUnlock(real(f), l);
}
inline int reserved(sqlite3_file* f, int* out) {
  return real(f)->pMethods->xCheckReservedLock(real(f), out);
}
inline int control(sqlite3_file* f, int op, void* arg) {
  return real(f)->pMethods->xFileControl(real(f), op, arg);
}
inline int sector(sqlite3_file* f) {
  return real(f)->pMethods->xSectorSize(real(f));
}
inline int traits(sqlite3_file* f) {
  return real(f)->pMethods->xDeviceCharacteristics(real(f));
}
inline int shm_map(sqlite3_file* f, int page, int bytes, int extend, volatile void** out) {
  return real(f)->pMethods->xShmMap(real(f), page, bytes, extend, out);
}
inline int shm_lock(sqlite3_file* f, int at, int n, int flags) {
  return real(f)->pMethods->xShmLock(real(f), at, n, flags);
}
inline void shm_barrier(sqlite3_file* f) {
  real(f)->pMethods->xShmBarrier(real(f));
}
inline int shm_unmap(sqlite3_file* f, int gone) {
  return real(f)->pMethods->xShmUnmap(real(f), gone);
}

inline const sqlite3_io_methods methods{
    2,       close,  read,   write,   truncate, sync,        size,      lock,    unlock, reserved,
    control, sector, traits, shm_map, shm_lock, shm_barrier, shm_unmap, nullptr, nullptr};

inline int open(sqlite3_vfs*, const char* name, sqlite3_file* file, int flags, int* out) {
  sqlite3_file* const under = real(file);
  under->pMethods = nullptr;
  reinterpret_cast<File*>(file)->name = name;
  const int code = below->xOpen(below, name, under, flags, out);
  file->pMethods = under->pMethods == nullptr ? nullptr : &methods;
  return code;
}
inline int remove(sqlite3_vfs*, const char* name, int sync_folder) {
  if (is_last()) die();
  return below->xDelete(below, name, sync_folder);
}

/// From here on, every database of this process is written through the layer.
inline void begin(KillPoint at) {
  static sqlite3_vfs layer;
  torn = at.torn;
  writes_left = at.write > 0 && at.after_trials == 0 ? at.write : never;
  below = sqlite3_vfs_find(nullptr);
  layer = *below;
  layer.zName = "killing";
  layer.szOsFile = below->szOsFile + static_cast<int>(sizeof(File));
  layer.pNext = nullptr;
  layer.xOpen = open;
  layer.xDelete = remove;
  sqlite3_vfs_register(&layer, 1);
}

}  // namespace killing

/// Number of complete trials that a child reported before it died. The counter is in memory that
/// outlives the child; it is not read from its files.
class ReportedTrials {
 public:
  ReportedTrials() = default;
  ReportedTrials(const ReportedTrials&) = delete;
  ReportedTrials& operator=(const ReportedTrials&) = delete;
  ~ReportedTrials() {
    if (shared_ != MAP_FAILED) munmap(shared_, sizeof(Count));
  }
  [[nodiscard]] std::uint64_t complete() const { return count().load(); }
  [[nodiscard]] CampaignHooks hooks() const {
    CampaignHooks hooks;
    hooks.progress = [this](const TrialProgress& line) {
      if (line.outcome == recipes::Outcome::complete) ++count();
    };
    return hooks;
  }

 private:
  using Count = std::atomic<std::uint64_t>;
  [[nodiscard]] Count& count() const { return *static_cast<Count*>(shared_); }
  void* shared_ =
      mmap(nullptr, sizeof(Count), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
};

/// Runs the campaign in a child. True if it was killed; false if it was completed. Nothing is
/// returned for any other exit status.
inline std::optional<bool> killed_at(const CampaignRequest& request, KillPoint point,
                                     const CampaignHooks& hooks = {}) {
  const pid_t child = fork();
  if (child == 0) {
    killing::begin(point);
    CampaignHooks counting = hooks;
    if (point.after_trials > 0)
      counting.progress = [&](const TrialProgress& line) {
        if (hooks.progress) hooks.progress(line);
        if (line.done == point.after_trials) killing::writes_left = point.write;
      };
    const auto summary = run_campaign(request, counting);
    _exit(summary && summary->outcome == recipes::Outcome::complete ? 0 : 1);
  }
  int status = 0;
  if (child < 0 || waitpid(child, &status, 0) != child) return std::nullopt;
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL) return true;
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return false;
  return std::nullopt;
}

/// A very short stroke on each of two fabrics.
inline std::string tiny_recipe(int repetitions) {
  return R"({"schema_version":1,"name":"tiny","source":"test","seed":7,"fabrics":["denim","satin"],
    "repetitions":)" +
         std::to_string(repetitions) +
         R"(,"explorations":{"M1":{"phases":[{"phase":"S","duration_s":0.2},
    {"phase":"P","force_N":5,"force_band_N":0.25,"duration_s":0.2},
    {"phase":"M","force_N":5,"force_band_N":0.25,"speed_mm_s":4,"path":[{"dx_mm":0,"dy_mm":2}]},
    {"phase":"E","duration_s":0.2}]}}})";
}

/// First difference of two campaigns, trial by trial; empty if there is none. The number of the
/// attempt, and the name with it, are ignored.
inline std::string difference(const Dataset& a, const Dataset& b) {
  if (a.trials.size() != b.trials.size())
    return std::to_string(a.trials.size()) + " and " + std::to_string(b.trials.size()) + " trials";
  for (std::size_t i = 0; i < a.trials.size(); ++i) {
    classifier::Trial trial = b.trials[i];
    TrialRecord record = b.records[i];
    trial.file = a.trials[i].file;
    record.spec.attempt = a.records[i].spec.attempt;
    if (trial_sha256(a.trials[i], a.records[i]) != trial_sha256(trial, record))
      return "trial " + std::to_string(i);
  }
  return {};
}

}  // namespace weft::daemon::test
