#pragma once
// A campaign in a child process that dies at its n-th write to the campaign file: the main file,
// its log and what SQLite does beside them, seen through a file system layer of the child's own.
// Nothing of it is in the program under test. Linux.

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

/// Of a test that kills at every write: the nightly preset does, the others at each third.
inline std::uint64_t writes_between_kills() {
  return std::getenv("WEFT_EVERY_WRITE") != nullptr ? 1 : 3;
}

/// Which write ends the process, and whether half of it reaches the file.
struct KillPoint {
  std::uint64_t write = 0;  ///< from 1; 0: never
  bool torn = false;
  /// Writes are counted once so many trials are on record: how many writes a trial takes depends on
  /// how fast the machine is.
  std::size_t after_trials = 0;
};

namespace killing {

inline constexpr std::uint64_t never = std::numeric_limits<std::uint64_t>::max();
inline bool torn = false;
inline std::atomic<std::uint64_t> writes_left = never;  ///< of all threads
inline sqlite3_vfs* below = nullptr;
inline void (*synced)(const char* file) = nullptr;  ///< told once the disk has all of a file

/// SQLite's handle; the real one lies behind it.
struct File {
  sqlite3_file base;
  const char* name;
  sqlite3_file* real() { return reinterpret_cast<sqlite3_file*>(this + 1); }
};
inline sqlite3_file* real(sqlite3_file* file) {
  return reinterpret_cast<File*>(file)->real();
}

/// True where this is the one: then the process is over, perhaps after half of the write.
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

/// From here on every database of this process is written through the layer.
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

/// Complete trials that a child told of before it died: counted in memory that outlives it, and not
/// read from what it left behind.
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

/// Runs the campaign in a child. True when it was killed; false when it came to its end, complete.
/// Anything else is a child that says so with another status: nothing is returned.
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

/// A very short slide on each of two fabrics.
inline std::string tiny_recipe(int repetitions) {
  return R"({"schema_version":1,"name":"tiny","source":"test","seed":7,"fabrics":["denim","satin"],
    "repetitions":)" +
         std::to_string(repetitions) +
         R"(,"explorations":{"M1":{"phases":[{"phase":"S","duration_s":0.2},
    {"phase":"P","force_N":5,"force_band_N":0.25,"duration_s":0.2},
    {"phase":"M","force_N":5,"force_band_N":0.25,"speed_mm_s":4,"path":[{"dx_mm":0,"dy_mm":2}]},
    {"phase":"E","duration_s":0.2}]}}})";
}

/// What two campaigns must have in common, trial by trial; empty when they do, else the first
/// difference. The number of the attempt and the name that carries it are not part of it.
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
