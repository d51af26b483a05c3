// The daemon while its disk is full, and after there is space again.

#include <sys/resource.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "daemon/base/file/atomic_file.hpp"
#include "daemon/service/methods/services.hpp"
#include "tests/unit/daemon/service/run_manager_bench.hpp"

namespace full_disk_test {

using namespace weft;
using namespace weft::daemon;
using nlohmann::json;
using runs::RunState;
using test::RunManagerBench;
using test::TemporaryFolder;

namespace {

/// During its lifetime the files of this process cannot grow: SQLite's writes are refused.
class FullDisk {
 public:
  FullDisk() : was_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &limit_);
    const rlimit one_byte{1, limit_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &one_byte);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;
  ~FullDisk() {
    setrlimit(RLIMIT_FSIZE, &limit_);
    static_cast<void>(std::signal(SIGXFSZ, was_));
  }

 private:
  rlimit limit_{};
  void (*was_)(int);
};

std::size_t lines_of(runs::RunStore& store, std::string_view kind) {
  const auto lines = store.tail("", 1000);
  REQUIRE(lines);
  return static_cast<std::size_t>(
      std::count_if(lines->begin(), lines->end(), [&](const auto& l) { return l.kind == kind; }));
}

}  // namespace

TEST_CASE("what became of a run while the disk was full is written down once it has room") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder);
  const std::string id = bench.submit().stored.id();
  CHECK(bench.store.is_persisted());
  const std::size_t reported = lines_of(bench.store, "state");
  {
    const FullDisk full;
    CHECK(bench.manager->order(id, Order::abort, "ada"));
    bench.manager->tick();
    CHECK_FALSE(bench.store.is_persisted());
  }
  CHECK(bench.store.runs()->front().state == RunState::arming);
  bench.manager->tick();
  CHECK(bench.store.is_persisted());
  CHECK(bench.store.runs()->front().state == RunState::aborting);
  CHECK(lines_of(bench.store, "state") == reported + 1);
  CHECK(bench.ended(id).machine.state == RunState::ended);
}

TEST_CASE("a run with a last trial that filled the disk is concluded once there is room") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder);
  std::optional<FullDisk> full;
  bench.at_line = [&](const TrialProgress& line, RunOrders&) {
    if (line.done == line.planned) full.emplace();
  };
  const std::string id = bench.submit().stored.id();
  const runs::RunView cut = bench.ended(id);
  full.reset();
  bench.at_line = {};
  CHECK(cut.machine.state == RunState::interrupted);
  CHECK(cut.stored.outcome == "complete");
  CHECK_FALSE(cut.stored.dataset_error.empty());
  CHECK_FALSE(load_progress(cut.stored.folder / campaign_file_name)->finished);
  bench.manager->tick();
  bool moves = false;
  bench.at_rig = [&] { moves = true; };
  REQUIRE(bench.recover(id, "test"));
  const runs::RunView whole = bench.ended(id);
  INFO(whole.stored.error << whole.stored.dataset_error);
  CHECK(whole.machine.state == RunState::ended);
  CHECK_FALSE(moves);
  CHECK_FALSE(whole.stored.dataset_sha256.empty());
  CHECK((whole.stored.outcome == "complete" && whole.stored.cleanup == "done"));
  CHECK(whole.stored.rig_fact == "safe");
}

TEST_CASE("a wish for the line that cannot be kept changes nothing") {
  const TemporaryFolder folder;
  RunManagerBench bench(folder);
  bench.manager->halt(runs::RigState::Stop::halt, "test");
  bench.submit();
  const std::string second = bench.submit().stored.id();
  const runs::RunQueue before = bench.manager->queue();
  {
    const FullDisk full;
    CHECK_FALSE(bench.manager->edit(second, {.place = 0}, "ada"));
    CHECK_FALSE(bench.manager->pause_queue("ada"));
    CHECK_FALSE(bench.manager->remove(second, "ada"));
  }
  CHECK(bench.manager->get(second)->machine.state == RunState::queued);
  CHECK(bench.manager->queue() == before);
  CHECK(bench.store.queue().value() == before);
  CHECK(lines_of(bench.store, "edited") == 0);
  REQUIRE(bench.manager->pause_queue("ada"));
  {
    const FullDisk full;
    CHECK_FALSE(bench.manager->resume_queue("ada"));
  }
  CHECK(bench.manager->queue().is_paused());
  CHECK(lines_of(bench.store, "queue_started") == 0);
  REQUIRE(bench.manager->resume_queue("ada"));
  CHECK(lines_of(bench.store, "queue_started") == 1);
}

TEST_CASE("streaming a file to a full disk fails with the cause, and leaves the old file") {
  const TemporaryFolder folder;
  const auto path = folder / "model.weft";
  const auto writes = [](std::string text) {
    return [text = std::move(text)](std::ostream& out) -> Status {
      out << text;
      if (out.flush()) return {};
      return fail(
          {.code = Errc::io, .what = "cannot write the model"});  // like the writers of models
    };
  };
  REQUIRE(write_streamed_file(path, writes("old\n")));
  {
    const FullDisk full;
    const Status refused = write_streamed_file(path, writes(std::string(100'000, 'x')));
    REQUIRE_FALSE(refused);
    CHECK(refused.error().where == path.string());
    CHECK(refused.error().got == std::strerror(EFBIG));
  }
  const Status refused = write_streamed_file(path, [](std::ostream&) -> Status {
    return fail({.code = Errc::range, .what = "not to be written"});
  });
  REQUIRE_FALSE(refused);
  CHECK(refused.error().what == "not to be written");
  std::ifstream in(path);
  CHECK(std::string(std::istreambuf_iterator<char>(in), {}) == "old\n");
  CHECK(std::distance(std::filesystem::directory_iterator(folder.path()), {}) == 1);
}

TEST_CASE("leases and tokens do not change if their journal line cannot be written") {
  const TemporaryFolder folder;
  auto store = runs::RunStore::open(folder / "weftd.sqlite");
  REQUIRE(store);
  server::Hub hub;
  access::Leases leases("9c1d40b2");
  std::vector<std::string> tokens;
  api::Services services;
  services.hub = &hub;
  services.leases = &leases;
  services.log = &*store;
  services.rig_name = "bench";
  services.now = [] { return std::chrono::nanoseconds{}; };
  services.utc_us = [] { return std::int64_t{0}; };
  services.add_token = [&](std::string name, access::Role, std::int64_t,
                           const std::string&) -> Result<std::string> {
    if (std::find(tokens.begin(), tokens.end(), name) != tokens.end())
      return fail({.code = Errc::invalid_argument, .where = "token", .what = "name in use"});
    tokens.push_back(std::move(name));
    return "wft_0";
  };
  services.remove_token = [&](std::string_view name) -> Status {
    std::erase(tokens, name);
    return {};
  };
  rpc::Methods methods;
  api::add_lease_methods(methods, services);
  api::add_token_methods(methods, services);
  const auto call = [&](std::string_view method, const json& params) {
    rpc::Outcome answer;
    const rpc::Caller ada{"s-1", "test", "ada", access::Role::admin, true};
    methods.find(method).value()->handler({params, ada}, [&](rpc::Outcome o) { answer = o; });
    return answer;
  };
  {
    const FullDisk full;
    CHECK_FALSE(call("lease.acquire", json::object()));
    CHECK_FALSE(call("token.add", {{"name", "page"}}));
  }
  CHECK(leases.all({}).empty());
  CHECK(tokens.empty());
  const auto taken = call("lease.acquire", json::object());
  REQUIRE(taken);
  const json lease{{"lease", json::parse(*taken).at("lease")}, {"reason", "a test"}};
  for (const char* method : {"lease.release", "lease.break"}) {
    const FullDisk full;
    CHECK_FALSE(call(method, lease));
    CHECK(leases.all({}).size() == 1);
  }
  CHECK(call("lease.release", lease));
  CHECK(leases.all({}).empty());
  REQUIRE(call("token.add", {{"name", "page"}}));
  const auto again = call("token.add", {{"name", "page"}});
  REQUIRE_FALSE(again);
  CHECK(again.error().kind == "token.name_taken");
}

}  // namespace full_disk_test
