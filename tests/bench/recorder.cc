// Rows a second of the campaign recorder, with CRC and chunks, compared with one SQLite statement a
// row and with a plain file, for the same numbers on the same disk. All three end with the data on
// the disk (fsync).

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include "daemon/storage/recorder/recorder.hpp"
#include "daemon/storage/recorder/sqlite.hpp"
#include "tests/bench/figures.hpp"

namespace {

using namespace weft;
using namespace weft::daemon;
namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr std::uint32_t rows = 400'000;  // force samples: 67 minutes at 100 Hz
constexpr std::uint32_t rows_a_commit = 2'000;
constexpr int runs = 5;

template <class Value>
Value must(Result<Value> got) {
  if (got) return std::move(*got);
  std::fprintf(stderr, "%s\n", to_string(got.error()).c_str());
  std::exit(1);
}

void must(const Status& done) {
  if (done) return;
  std::fprintf(stderr, "%s\n", to_string(done.error()).c_str());
  std::exit(1);
}

WrenchSample sample(std::uint32_t i) {
  WrenchSample out;
  for (std::size_t k = 0; k < 3; ++k) {
    out.force_n[k] = 1e-6 * static_cast<double>((i * 7919 + k) % 5'000'000);
    out.torque_nm[k] = 1e-9 * static_cast<double>((i * 104'729 + k) % 5'000'000);
  }
  return out;
}

TimePoint at(std::uint32_t i) {
  return TimePoint(std::chrono::milliseconds(10) * i);
}

void on_disk(const fs::path& file) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0 || ::fsync(descriptor) != 0) std::exit(1);
  ::close(descriptor);
}

void by_recorder(const fs::path& file) {
  CampaignHeader header;
  header.trials_planned = 1;
  header.info.kind = BenchKind::simulated;
  header.info.recipe_json = header.info.rig_json = "{}";
  header.info.wrench_rate_hz = 100;
  Recorder recorder = must(Recorder::create(file, header));
  must(recorder.begin_trial({0, 0, "denim", "r1", "M1", 1, 1}, at(0)));
  for (std::uint32_t i = 0; i < rows; ++i) {
    must(recorder.wrench({at(i), i, 0}, sample(i)));
    if (i % rows_a_commit == 0) must(recorder.commit());
  }
  must(recorder.end_trial(TrialOutcome::complete, {}, at(rows)));
  must(recorder.finish());
  on_disk(file);
}

void by_sqlite(const fs::path& file) {
  auto database = must(sqlite::Database::open(file, sqlite::Mode::create));
  must(database.execute("PRAGMA journal_mode=WAL; PRAGMA synchronous=NORMAL"));
  must(database.execute("CREATE TABLE wrench (t_ns, sequence, fx, fy, fz, tx, ty, tz)"));
  auto insert = must(database.prepare("INSERT INTO wrench VALUES (?, ?, ?, ?, ?, ?, ?, ?)"));
  must(database.execute("BEGIN"));
  for (std::uint32_t i = 0; i < rows; ++i) {
    const WrenchSample one = sample(i);
    insert.bind(1, std::int64_t{at(i).time_since_epoch().count()}).bind(2, std::int64_t{i});
    for (int k = 0; k < 3; ++k) {
      insert.bind(3 + k, one.force_n[static_cast<std::size_t>(k)]);
      insert.bind(6 + k, one.torque_nm[static_cast<std::size_t>(k)]);
    }
    must(insert.run());
    if (i % rows_a_commit == 0) must(database.execute("COMMIT; BEGIN"));
  }
  must(database.execute("COMMIT; PRAGMA journal_mode=DELETE"));
  on_disk(file);
}

void by_file(const fs::path& file) {
  std::FILE* out = std::fopen(file.c_str(), "wb");
  if (out == nullptr) std::exit(1);
  for (std::uint32_t i = 0; i < rows; ++i) {
    const WrenchSample one = sample(i);
    const std::int64_t t_ns = at(i).time_since_epoch().count();
    std::fwrite(&t_ns, sizeof t_ns, 1, out);
    std::fwrite(&i, sizeof i, 1, out);
    std::fwrite(one.force_n.data(), sizeof(double), 3, out);
    std::fwrite(one.torque_nm.data(), sizeof(double), 3, out);
    if (i % rows_a_commit == 0) std::fflush(out);
  }
  std::fclose(out);
  on_disk(file);
}

struct Way {
  const char* name;
  void (*write)(const fs::path&);
  std::vector<double> rows_per_s = {};
  double bytes_a_row = 0;
};

}  // namespace

int main() {
  char name[] = "/tmp/weft-bench-XXXXXX";
  const fs::path folder = ::mkdtemp(name);
  Way ways[] = {
      {"recorder", by_recorder}, {"SQLite, a row a statement", by_sqlite}, {"plain file", by_file}};
  for (int run = 0; run < runs; ++run)
    for (Way& way : ways) {
      const fs::path file = folder / ("run" + std::to_string(run) + way.name);
      const auto begin = Clock::now();
      way.write(file);
      way.rows_per_s.push_back(rows / std::chrono::duration<double>(Clock::now() - begin).count());
      way.bytes_a_row = static_cast<double>(fs::file_size(file)) / rows;
      fs::remove(file);
    }
  fs::remove_all(folder);
  std::vector<bench::Figure> figures;
  const double ours = bench::median(ways[0].rows_per_s);
  for (Way* way : {&ways[1], &ways[2]})
    figures.push_back({"rows of the force sensor, recorder", ours, "1/s", way->name,
                       bench::median(way->rows_per_s), "a bench makes 100 to 1000 a second"});
  for (Way* way : {&ways[1], &ways[2]})
    figures.push_back(
        {"bytes a row, recorder", ways[0].bytes_a_row, "B", way->name, way->bytes_a_row, ""});
  return bench::report("recorder", figures);
}
