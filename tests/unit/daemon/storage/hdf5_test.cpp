#include <hdf5.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <csignal>
#include <cstdlib>
#include <thread>

#include "daemon/storage/certificate/verify.hpp"
#include "daemon/storage/dataset/dataset_reader.hpp"
#include "daemon/storage/dataset/dataset_writer.hpp"
#include "daemon/storage/dataset/hdf5_columns.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"
#include "daemon/storage/recordings/recording_set.hpp"
#include "tests/unit/daemon/storage/hdf5_poke.hpp"
#include "tests/unit/daemon/storage/support.hpp"

namespace hdf5_test {

/// The HDF5 library leaks memory when it rejects a damaged file. Used only by the leak sanitizer.
extern "C" const char* __lsan_default_suppressions();  // NOLINT(bugprone-reserved-identifier)
extern "C" const char* __lsan_default_suppressions() {
  return "leak:libhdf5_serial";
}

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::test;

namespace {

Dataset recorded(const TemporaryFolder& folder, std::uint32_t trials = 4,
                 std::uint32_t samples = 60) {
  const auto path = folder / "campaign.weft";
  REQUIRE(record_campaign(path, trials, samples));
  auto dataset = load_campaign(path);
  REQUIRE(dataset);
  std::filesystem::remove(path);
  return std::move(*dataset);
}

Error read_error(const std::filesystem::path& path) {
  const auto dataset = read_hdf5(path);
  REQUIRE_FALSE(dataset);
  return dataset.error();
}

bool python_has_h5py() {
  return std::system("/usr/bin/python3 -c 'import h5py' 2>/dev/null") == 0;
}

bool python_verifies(const std::filesystem::path& file) {
  const std::string command = "/usr/bin/python3 " WEFT_SOURCE_DIR
                              "/tests/unit/daemon/storage/verify_dataset.py " +
                              file.string() + " >/dev/null";
  return std::system(command.c_str()) == 0;
}

}  // namespace

TEST_CASE("recorder, campaign file, HDF5 and back: equal bit for bit, digest included") {
  const TemporaryFolder folder;
  const Dataset original = recorded(folder);
  const auto digest = write_hdf5(original, folder / "d.h5");
  REQUIRE(digest);
  CHECK(*digest == dataset_sha256(original));
  const auto copy = read_hdf5(folder / "d.h5");
  REQUIRE(copy);
  CHECK(same_content(*copy, original));
  CHECK(dataset_sha256(*copy) == *digest);
}

TEST_CASE("fractional counts, missing device clocks, streams and qualities survive") {
  Dataset dataset;
  dataset.info.name = "imported";
  dataset.trials = {
      {"a.csv", "Silk", "", 2, {0.1, -0.0, 1e300, 5e-324}, {Phase::motion, Phase::end}},
      {"b.csv", "Wool", "g", 2, {1, 2}, {Phase::rest}}};
  dataset.records.resize(2);
  dataset.records[0].t_ns = {-5, 7};
  dataset.records[1].t_ns = {0};
  for (std::size_t i = 0; i < 2; ++i) {
    dataset.records[i].spec.label = dataset.trials[i].label;
    dataset.records[i].spec.group = dataset.trials[i].group;
  }
  const TemporaryFolder folder;
  REQUIRE(write_hdf5(dataset, folder / "d.h5"));
  const auto copy = read_hdf5(folder / "d.h5");
  REQUIRE(copy);
  CHECK(same_content(*copy, dataset));
  CHECK(std::signbit(copy->trials[0].counts[1]));
}

namespace {

// Number of objects of a file, groups and columns; none may contain a time.
std::size_t count_timeless(const std::filesystem::path& path) {
  const hdf5::Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  std::size_t objects = 0;
  const auto visit = [](hid_t, const char*, const H5O_info_t* info, void* count) -> herr_t {
    const bool timeless =
        info->atime == 0 && info->mtime == 0 && info->ctime == 0 && info->btime == 0;
    ++*static_cast<std::size_t*>(count);
    return timeless ? 0 : -1;
  };
  REQUIRE(H5Ovisit(file.id(), H5_INDEX_NAME, H5_ITER_INC, visit, &objects) == 0);
  return objects;
}

}  // namespace

TEST_CASE("equal content makes equal files, at any time") {
  const TemporaryFolder folder;
  const Dataset dataset = recorded(folder);
  const RecordingSet sounds{
      "s", "recordings", BenchKind::real, {{"a.csv", "felt", "1", {{"X", 100.0, "1"}}, {{1, 2}}}}};
  REQUIRE(write_hdf5(dataset, folder / "a.h5"));
  REQUIRE(write_hdf5(dataset, folder / "b.h5"));
  CHECK(read_file(folder / "a.h5") == read_file(folder / "b.h5"));
  REQUIRE(write_recordings(sounds, folder / "sounds.h5"));
  CHECK(count_timeless(folder / "a.h5") > 30);
  CHECK(count_timeless(folder / "sounds.h5") > 8);
}

TEST_CASE("an altered number is found, and the trial it is in is named") {
  const TemporaryFolder folder;
  const auto path = folder / "d.h5";
  const Dataset dataset = recorded(folder, 4, 60);
  REQUIRE(write_hdf5(dataset, path));
  const std::string second = path.string() + ": trial 0001-Silk-M1-r00";
  SECTION("a count") {
    poke(path, "/taxel/counts", 60, std::uint16_t{9});
  }
  SECTION("a phase") {
    poke(path, "/taxel/phase", 119, std::uint8_t{'E'});
  }
  SECTION("a time") {
    poke(path, "/taxel/t_ns", 61, std::int64_t{1});
  }
  SECTION("a force") {
    poke(path, "/wrench/quanta", 100, std::int32_t{-3});
  }
  SECTION("a position") {
    poke(path, "/stages/quanta", 119, std::int32_t{12345});
  }
  SECTION("a seed") {
    poke(path, "/trials/patch_seed", 1, std::uint64_t{1});
  }
  const Error error = read_error(path);
  CHECK(error.code == Errc::corrupt);
  CHECK(error.where == second);
  CHECK(read_hdf5(path, false));
}

TEST_CASE("a column that cannot be unpacked is reported with the trials of the lost rows") {
  const TemporaryFolder folder;
  const auto path = folder / "d.h5";
  constexpr std::uint32_t samples = 20000;  // the times of a trial take more than half a chunk
  const Dataset dataset = recorded(folder, 4, samples);
  REQUIRE(write_hdf5(dataset, path));
  flip_stored_bit(path, "/taxel/t_ns", samples * 4 - 1);
  const Error error = read_error(path);
  CHECK(error.code == Errc::corrupt);
  CHECK(error.where == path.string() + ": /taxel/t_ns of trial " + dataset.trials[3].file);
  CHECK(error.what == "column damaged");
}

TEST_CASE("a damaged column of a stream names its trials too") {
  const TemporaryFolder folder;
  const auto path = folder / "d.h5";
  const Dataset dataset = recorded(folder);
  REQUIRE(write_hdf5(dataset, path));
  flip_stored_bit(path, "/wrench/quanta", 0);
  CHECK(read_error(path).where ==
        path.string() + ": /wrench/quanta of trials " + dataset.trials[0].file + ", " +
            dataset.trials[1].file + ", " + dataset.trials[2].file + ", " + dataset.trials[3].file);
}

TEST_CASE("a simulated set with an altered bench kind is refused") {
  const TemporaryFolder folder;
  Dataset dataset = recorded(folder);
  REQUIRE(write_hdf5(dataset, folder / "d.h5"));
  {
    const hdf5::Handle file(H5Fopen((folder / "d.h5").c_str(), H5F_ACC_RDWR, H5P_DEFAULT),
                            H5Fclose);
    const hdf5::Handle kind(H5Aopen(file.id(), "bench_kind", H5P_DEFAULT), H5Aclose);
    const hdf5::Handle type(H5Aget_type(kind.id()), H5Tclose);
    REQUIRE(H5Awrite(kind.id(), type.id(), "real\0\0\0\0\0\0\0\0") >= 0);
  }
  CHECK(read_error(folder / "d.h5").where.ends_with("dataset_sha256"));
  // The digests of its trials do not cover the bench.
  auto reader = DatasetReader::open(folder / "d.h5");
  REQUIRE(reader);
  CHECK(reader->load(0));
  CHECK(reader->check_digest().error().code == Errc::corrupt);
}

TEST_CASE("extents and phases that make no sense are refused before they are used") {
  const TemporaryFolder folder;
  const auto path = folder / "d.h5";
  REQUIRE(write_hdf5(recorded(folder), path));
  SECTION("a trial longer than the set") {
    poke(path, "/trials/taxel_samples", 1, std::uint64_t{0xFFFFFFFFFFFFFFFF});
  }
  SECTION("trials that do not add up") {
    poke(path, "/trials/taxel_samples", 0, std::uint64_t{59});
  }
  SECTION("a stream longer than stored") {
    poke(path, "/trials/wrench_samples", 0, std::uint64_t{1} << 63);
  }
  SECTION("an unknown phase") {
    poke(path, "/taxel/phase", 5, std::uint8_t{'X'});
  }
  CHECK(read_error(path).code == Errc::corrupt);
}

TEST_CASE("a truncated HDF5 file is refused with its name") {
  const TemporaryFolder folder;
  REQUIRE(write_hdf5(recorded(folder), folder / "d.h5"));
  const std::string whole = read_file(folder / "d.h5");
  for (std::size_t tenth = 0; tenth < 10; ++tenth) {
    write_file(folder / "cut.h5", whole.substr(0, whole.size() * tenth / 10 + 1));
    const Error error = read_error(folder / "cut.h5");
    CHECK((error.code == Errc::parse || error.code == Errc::corrupt));
    CHECK(error.where.starts_with((folder / "cut.h5").string()));
  }
  write_file(folder / "cut.h5", whole.substr(0, whole.size() - 1));
  CHECK(read_error(folder / "cut.h5").code == Errc::corrupt);
}

TEST_CASE("a flipped byte is found or does not matter") {
  const TemporaryFolder folder;
  const Dataset original = recorded(folder);
  REQUIRE(write_hdf5(original, folder / "d.h5"));
  const std::string whole = read_file(folder / "d.h5");
  for (std::size_t at = 0; at < whole.size(); at += 101) {
    std::string flipped = whole;
    flipped[at] = static_cast<char>(flipped[at] ^ 0x04);
    write_file(folder / "flipped.h5", flipped);
    const auto dataset = read_hdf5(folder / "flipped.h5");
    if (!dataset) continue;
    CHECK(dataset_sha256(*dataset) == dataset_sha256(original));
  }
}

TEST_CASE("other files are told apart") {
  const TemporaryFolder folder;
  CHECK(read_error(folder / "absent.h5").code == Errc::not_found);
  write_file(folder / "text.h5", "file,label\n");
  CHECK(read_error(folder / "text.h5").code == Errc::parse);
  CHECK(read_error(folder / "text.h5").got == "text");
  {
    const hdf5::Handle file(
        H5Fcreate((folder / "other.h5").c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT),
        H5Fclose);
  }
  CHECK(read_error(folder / "other.h5").code == Errc::parse);
  CHECK(read_error(folder / "other.h5").expected == hdf5::format_name);
}

namespace {

std::size_t pass_through(unsigned, std::size_t, const unsigned*, std::size_t bytes, std::size_t*,
                         void**) {
  return bytes;
}

}  // namespace

TEST_CASE("a column with a missing filter is reported with the filter and advice") {
  constexpr H5Z_filter_t number = 321;
  const H5Z_class2_t filter{H5Z_CLASS_T_VERS, number,  1,       1,
                            "squeeze",        nullptr, nullptr, pass_through};
  const TemporaryFolder folder;
  REQUIRE(write_hdf5(recorded(folder), folder / "d.h5"));
  REQUIRE(H5Zregister(&filter) >= 0);
  {
    const hdf5::Handle file(H5Fopen((folder / "d.h5").c_str(), H5F_ACC_RDWR, H5P_DEFAULT),
                            H5Fclose);
    REQUIRE(H5Ldelete(file.id(), "/taxel/t_ns", H5P_DEFAULT) >= 0);
    const hsize_t size = 240;
    const hdf5::Handle space(H5Screate_simple(1, &size, nullptr), H5Sclose);
    const hdf5::Handle properties(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
    H5Pset_chunk(properties.id(), 1, &size);
    H5Pset_filter(properties.id(), number, 0, 0, nullptr);
    const hdf5::Handle column(H5Dcreate2(file.id(), "/taxel/t_ns", H5T_NATIVE_INT64, space.id(),
                                         H5P_DEFAULT, properties.id(), H5P_DEFAULT),
                              H5Dclose);
    const std::vector<std::int64_t> zeros(size);
    REQUIRE(H5Dwrite(column.id(), H5T_NATIVE_INT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, zeros.data()) >=
            0);
  }
  H5Zunregister(number);
  const Error refused = read_error(folder / "d.h5");
  CHECK(refused.code == Errc::unsupported);
  CHECK(verify(folder / "d.h5").error().code == Errc::unsupported);
  CHECK(refused.where.find("/taxel/t_ns") != std::string::npos);
  CHECK(refused.got.find("squeeze") != std::string::npos);
  CHECK(refused.got.find("321") != std::string::npos);
  CHECK(refused.hint.find("h5repack") != std::string::npos);
}

TEST_CASE("a name that is not UTF-8 is stored as text that is") {
  const TemporaryFolder folder;
  Dataset dataset = recorded(folder);
  dataset.info.name =
      "vers\xfc"
      "che";
  REQUIRE(write_hdf5(dataset, folder / "d.h5"));
  const auto copy = read_hdf5(folder / "d.h5");
  REQUIRE(copy);
  CHECK(copy->info.name == "vers\uFFFDche");
}

TEST_CASE("a failed write leaves the older file and nothing else") {
  const TemporaryFolder folder;
  Dataset dataset = recorded(folder);
  write_file(folder / "d.h5", "older");
  dataset.records[2].t_ns.pop_back();
  const auto refused = write_hdf5(dataset, folder / "d.h5");
  REQUIRE_FALSE(refused);
  CHECK(refused.error().where.ends_with("trial 0002-Denim-M1-r01"));
  CHECK(read_file(folder / "d.h5") == "older");
  CHECK(files_in(folder.path()) == 1);

  CHECK_FALSE(write_hdf5(Dataset{}, folder / "d.h5"));
  dataset = recorded(folder);
  CHECK(write_hdf5(dataset, "/proc/d.h5").error().code == Errc::io);
  std::filesystem::create_directory(folder / "taken");
  CHECK(write_hdf5(dataset, folder / "taken").error().code == Errc::io);
  CHECK(files_in(folder.path()) == 2);
}

TEST_CASE("a disk that fills up while a set is written is an error and leaves nothing behind") {
  const TemporaryFolder folder;
  const Dataset dataset = recorded(folder, 2, 9000);
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{1 << 17, 1 << 17};  // 128 KiB: the set needs more
    setrlimit(RLIMIT_FSIZE, &limit);
    const auto refused = write_hdf5(dataset, folder / "d.h5");
    _exit(!refused && refused.error().code == Errc::io ? 9 : 1);
  }
  int state = 0;
  REQUIRE(waitpid(child, &state, 0) == child);
  CHECK(WIFEXITED(state));
  CHECK(WEXITSTATUS(state) == 9);
  CHECK(files_in(folder.path()) == 0);
}

TEST_CASE("h5py reads the file, and an independent program finds the same digests") {
  if (!python_has_h5py()) {
    WARN("skipped: /usr/bin/python3 has no h5py (Debian: python3-h5py)");
    return;
  }
  const TemporaryFolder folder;
  REQUIRE(write_hdf5(recorded(folder), folder / "d.h5"));
  CHECK(python_verifies(folder / "d.h5"));
}

TEST_CASE("a sweep's factors are in campaign file, data set and digest, and in no other set") {
  const TemporaryFolder folder;
  CampaignHeader header = small_header();
  header.info.factors = {"force_n", "speed_mps"};
  auto recorder = Recorder::create(folder / "c.weft", header);
  REQUIRE(recorder);
  for (std::uint32_t trial = 0; trial < 2; ++trial) {
    TrialSpec spec = small_spec(trial);
    spec.factors = {2.0 + trial, 0.001};
    REQUIRE(recorder->begin_trial(spec, at_ms(100000 * trial)));
    REQUIRE(record_samples(*recorder, trial, 20));
    REQUIRE(recorder->end_trial(TrialOutcome::complete, {}, at_ms(100000 * trial + 1)));
  }
  REQUIRE(recorder->finish());
  const auto swept = load_campaign(folder / "c.weft");
  REQUIRE(swept);
  CHECK(swept->info.factors == header.info.factors);
  CHECK(swept->records[1].spec.factors == std::vector<double>{3, 0.001});
  REQUIRE(write_hdf5(*swept, folder / "d.h5"));
  const auto copy = read_hdf5(folder / "d.h5");
  REQUIRE(copy);
  CHECK(same_content(*copy, *swept));
  if (python_has_h5py()) CHECK(python_verifies(folder / "d.h5"));
  Dataset other = *swept;
  other.records[1].spec.factors[0] = 4;
  CHECK(dataset_sha256(other) != dataset_sha256(*swept));
  other = *swept;
  other.info.factors[0] = "press_s";
  CHECK(dataset_sha256(other) != dataset_sha256(*swept));
  other.records[0].spec.factors.pop_back();
  CHECK_FALSE(write_hdf5(other, folder / "e.h5"));
  poke(folder / "d.h5", "/factors/values", 1, 9.0);
  CHECK(read_error(folder / "d.h5").code == Errc::corrupt);
  const TemporaryFolder plain;
  REQUIRE(write_hdf5(recorded(plain), folder / "p.h5"));
  CHECK(read_hdf5(folder / "p.h5")->info.factors.empty());
}

TEST_CASE("one thread exports while another ends a run, and both files are whole") {
  const TemporaryFolder folder;
  const Dataset exported = recorded(folder, 6, 200), ended = recorded(folder, 5, 150);
  const auto write_again = [&](const Dataset& dataset, const char* name) {
    for (int i = 0; i < 40; ++i) {
      const auto written = write_hdf5(dataset, folder / name);
      if (!written || !read_hdf5(folder / name)) return false;
    }
    return true;
  };
  bool other = false;
  {
    const std::jthread thread([&] { other = write_again(exported, "export.h5"); });
    CHECK(write_again(ended, "dataset.h5"));
  }
  CHECK(other);
  CHECK(same_content(read_hdf5(folder / "export.h5").value(), exported));
  CHECK(same_content(read_hdf5(folder / "dataset.h5").value(), ended));
}

TEST_CASE("a writer that waits for the library gives up at its next trial") {
  const TemporaryFolder folder;
  const Dataset dataset = recorded(folder);
  REQUIRE(dataset.trials.size() > 2);
  REQUIRE(write_hdf5(dataset, folder / "whole.h5"));
  std::atomic<int> inspections = 0;
  const auto give_up = [&inspections] { return ++inspections == 2; };
  std::optional<Error> refused;
  std::atomic<bool> begun = false;
  {
    std::unique_lock alone(hdf5::library());
    std::jthread writer([&] {
      begun = true;
      begun.notify_one();
      refused = write_hdf5(dataset, folder / "stopped.h5", give_up).error();
    });
    begun.wait(false);
    CHECK(inspections == 0);  // it waits
    alone.unlock();
  }
  REQUIRE(refused);
  CHECK(refused->code == Errc::wrong_state);
  CHECK(inspections == 2);
  CHECK_FALSE(std::filesystem::exists(folder / "stopped.h5"));
  const auto once = [] { return true; };
  CHECK(read_hdf5(folder / "whole.h5", true, once).error().code == Errc::wrong_state);
}

TEST_CASE("the library is free between the trials of a long file") {
  const TemporaryFolder folder;
  const Dataset dataset = recorded(folder);
  std::size_t free = 0;
  const auto inspect = [&] {
    std::thread([&] {
      const std::unique_lock other(hdf5::library(), std::try_to_lock);
      free += other.owns_lock() ? 1 : 0;
    }).join();
    return false;
  };
  REQUIRE(write_hdf5(dataset, folder / "d.h5", inspect));
  CHECK(free == dataset.trials.size());
  REQUIRE(read_hdf5(folder / "d.h5", true, inspect));
  CHECK(free == 2 * dataset.trials.size());
}

TEST_CASE("a data set is written and read trial by trial, with long columns too") {
  const TemporaryFolder folder;
  Dataset dataset = recorded(folder, 6, 200);
  // Longer than GrowingColumn::kept_bytes, so that these columns are written while they grow.
  for (TrialRecord& record : dataset.records) {
    record.wrench.t_ns.clear();
    record.wrench.quanta.clear();
    for (int i = 0; i < 30'000; ++i) {
      record.wrench.t_ns.push_back(1'000 * i + record.spec.index);
      for (int axis = 0; axis < 6; ++axis) record.wrench.quanta.push_back(i * 7 + axis);
    }
  }
  const auto digest = write_hdf5(dataset, folder / "d.h5");
  REQUIRE(digest);
  CHECK(*digest == dataset_sha256(dataset));
  CHECK(same_content(read_hdf5(folder / "d.h5").value(), dataset));
  auto reader = DatasetReader::open(folder / "d.h5");
  REQUIRE(reader);
  CHECK(reader->digest().dataset_sha256 == *digest);
  CHECK(reader->check_digest());
  for (const std::size_t i : {std::size_t{5}, std::size_t{0}, std::size_t{3}}) {  // any order
    const auto one = reader->load(i);
    REQUIRE(one);
    CHECK(one->trial.counts == dataset.trials[i].counts);
    CHECK(one->record.wrench == dataset.records[i].wrench);
    CHECK(one->record.stages == dataset.records[i].stages);
    CHECK(trial_sha256(one->trial, one->record) == reader->digest().trial_sha256[i]);
  }
}

TEST_CASE("a writer keeps its first error, and leaves no file") {
  const TemporaryFolder folder;
  const Dataset dataset = recorded(folder);
  {
    auto out = DatasetWriter::create(folder / "d.h5", dataset.info);
    REQUIRE(out);
    REQUIRE(out->add(dataset.trials[0], dataset.records[0]));
    classifier::Trial odd = dataset.trials[1];
    odd.counts.front() = 0.5;
    CHECK(out->add(odd, dataset.records[1]).error().where.find(odd.file) != std::string::npos);
    CHECK_FALSE(out->add(dataset.trials[2], dataset.records[2]));
    CHECK_FALSE(out->finish({}));
  }
  CHECK_FALSE(std::filesystem::exists(folder / "d.h5"));
  auto twice = DatasetWriter::create(folder / "e.h5", dataset.info);
  REQUIRE(twice);
  REQUIRE(twice->add(dataset.trials[0], dataset.records[0]));
  CHECK_FALSE(twice->add(dataset.trials[0], dataset.records[0]));
  auto empty = DatasetWriter::create(folder / "f.h5", dataset.info);
  REQUIRE(empty);
  CHECK_FALSE(empty->finish({}));
}

}  // namespace hdf5_test
