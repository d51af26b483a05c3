// Questions to the laboratory's store, through LabStore: bench_lab URI. tests/bench/lab.py fills
// the store with MADE UP rows. Peers in the same run: SELECT 1 (the round trip), and a sequential
// scan of the same question.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <random>

#include "daemon/service/lab/lab_store.hpp"
#include "tests/bench/figures.hpp"

namespace {

using namespace weft;
using namespace weft::daemon;
using bench::Figure;

constexpr std::size_t searches = 100, few = 9;
constexpr std::uint32_t seed = 51;
constexpr double search_aim_ms = 50, page_aim_ms = 1000;

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

/// Median and maximum [ms] of one call for each question.
struct Times {
  double median_ms = 0, longest_ms = 0;
};
template <class Question>
Times time_all(const std::vector<Question>& questions,
               const std::function<void(const Question&)>& work) {
  std::vector<double> seconds;
  for (const Question& each : questions) seconds.push_back(bench::seconds_of([&] { work(each); }));
  const double longest = *std::ranges::max_element(seconds);
  if (seconds.size() % 2 == 0) seconds.pop_back();
  return {1e3 * bench::median(seconds), 1e3 * longest};
}

/// Seeded numbers below a bound.
class Draws {
 public:
  std::uint32_t below(std::uint32_t bound) { return static_cast<std::uint32_t>(engine_() % bound); }

 private:
  std::mt19937 engine_{seed};
};

std::string padded(const char* format, std::uint32_t number) {
  char text[64];
  std::snprintf(text, sizeof text, format, number);
  return text;
}

/// Digests that exist, from the store.
std::vector<std::string> some_digests(lab::Connection& connection, const char* table,
                                      const char* column) {
  const std::string sql = std::string("SELECT ") + column + " FROM weft." + table +
                          " TABLESAMPLE system (5) REPEATABLE (51) LIMIT 100";
  const auto rows = must(connection.run_bound(sql.c_str(), {}));
  std::vector<std::string> out;
  for (std::size_t row = 0; row < rows.size(); ++row) out.push_back(rows.text(row, 0));
  return out;
}

struct Kind {
  std::string name;
  std::vector<lab::LabSearch> searches;
};

std::vector<Kind> make_searches(lab::Connection& connection) {
  Draws draws;
  const auto trial_digests = some_digests(connection, "trial", "sha256"),
             dataset_digests = some_digests(connection, "dataset", "dataset_sha256");
  const auto fill = [&](const std::function<lab::LabSearch(std::size_t)>& make) {
    std::vector<lab::LabSearch> list;
    for (std::size_t i = 0; i < searches; ++i) list.push_back(make(i));
    return list;
  };
  const auto fabric = [&] { return padded("fabric%03u", draws.below(118)); };
  std::vector<Kind> kinds;
  kinds.push_back({"fabric", fill([&](auto) { return lab::LabSearch{{}, "", fabric(), ""}; })});
  kinds.push_back(
      {"text, two words", fill([&](auto) {
         return lab::LabSearch{{}, fabric() + " R-0000" + padded("%02u", draws.below(99)), "", ""};
       })});
  kinds.push_back({"text, common", fill([&](auto) {
                     return lab::LabSearch{{}, "imprint", "", ""};
                   })});
  kinds.push_back({"text, two letters", fill([&](auto) {
                     return lab::LabSearch{{}, "m2", "", ""};
                   })});
  kinds.push_back({"text, unknown", fill([&](auto i) {
                     return lab::LabSearch{
                         {}, "no such " + padded("%u", static_cast<std::uint32_t>(i)), "", ""};
                   })});
  kinds.push_back(
      {"digest of a trial, 8 digits", fill([&](std::size_t i) {
         return lab::LabSearch{{}, "", "", trial_digests[i % trial_digests.size()].substr(0, 8)};
       })});
  kinds.push_back(
      {"digest of a trial, 4 digits", fill([&](std::size_t i) {
         return lab::LabSearch{{}, "", "", trial_digests[i % trial_digests.size()].substr(0, 4)};
       })});
  kinds.push_back({"digest of a data set", fill([&](std::size_t i) {
                     return lab::LabSearch{{}, "", "", dataset_digests[i % dataset_digests.size()]};
                   })});
  kinds.push_back({"rig, recipe and period", fill([&](auto) {
                     lab::LabSearch search;
                     search.rig = padded("rig%03u", draws.below(100));
                     search.recipe = "khan2016";
                     search.since_us =
                         1'751'000'000'000'000 + std::int64_t{draws.below(1000)} * 1'000'000'000;
                     return search;
                   })});
  return kinds;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "bench_lab URI SCANNER_URI NAME\n");
    return 2;
  }
  const auto address = must(lab::LabAddress::parse(argv[1]));
  auto store = must(lab::LabStore::open(address, "bench"));
  auto connection = must(lab::Connection::open(address, "bench"));
  const std::vector<int> rounds(searches);

  const Times trip = time_all<int>(rounds, [&](int) { must(store.ping()); });
  const std::string peer = "SELECT 1";
  std::vector<Figure> figures;
  const auto add = [&](const std::string& name, const Times& times, double aim_ms) {
    figures.push_back({name, times.median_ms, "ms", peer, trip.median_ms,
                       "longest " + std::to_string(times.longest_ms).substr(0, 5) + " ms",
                       bench::at_most(aim_ms)});
  };

  std::vector<lab::LabSearch> mixed;
  std::vector<Kind> kinds = make_searches(connection);
  for (const Kind& kind : kinds) {
    add("search: " + kind.name,
        time_all<lab::LabSearch>(kind.searches,
                                 [&](const auto& search) { must(store.search(search, 50)); }),
        search_aim_ms);
    mixed.insert(mixed.end(), kind.searches.begin(), kind.searches.begin() + 12);
  }
  std::shuffle(mixed.begin(), mixed.end(), std::mt19937(seed));
  mixed.resize(searches);
  add("search: 100 of all kinds",
      time_all<lab::LabSearch>(mixed, [&](const auto& search) { must(store.search(search, 50)); }),
      search_aim_ms);

  add("rigs for the page", time_all<int>(rounds, [&](int) { must(store.rigs()); }), page_aim_ms);
  add("first page of 50 runs", time_all<int>(rounds, [&](int) { must(store.runs({}, {}, 50)); }),
      page_aim_ms);
  auto after = must(store.runs({}, {}, 1000)).next;
  for (int i = 0; i < 4 && after; ++i) after = must(store.runs({}, after, 1000)).next;
  add("page of 50 runs after 5000",
      time_all<int>(rounds, [&](int) { must(store.runs({}, after, 50)); }), page_aim_ms);

  const auto scanner_address = must(lab::LabAddress::parse(argv[2]));
  auto scanner = must(lab::LabStore::open(scanner_address, "bench"));
  for (Kind& kind : kinds) {
    kind.searches.resize(few);
    const Times times = time_all<lab::LabSearch>(
        kind.searches, [&](const auto& search) { must(scanner.search(search, 50)); });
    const auto found = std::ranges::find(figures, "search: " + kind.name, &Figure::figure);
    figures.push_back(
        {"scan: " + kind.name, found->value, "ms", "without an index", times.median_ms, "", {}});
  }
  return bench::report(argv[3], figures);
}
