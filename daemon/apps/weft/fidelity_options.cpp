#include "daemon/apps/weft/fidelity_options.hpp"

#include <CLI/CLI.hpp>

#include "sim/plant/fidelity/table.hpp"

namespace weft::daemon::cli {
namespace {

template <class Parse>
auto problem_of(Parse parse) {
  return [parse](const std::string& text) {
    const Result<double> read = parse(text);
    return read ? std::string() : to_string(read.error());
  };
}

template <class Parse>
std::optional<double> read(const std::string& text, Parse parse) {
  if (text.empty()) return std::nullopt;
  const Result<double> value = parse(text);
  return value ? std::optional<double>(*value) : std::nullopt;
}

}  // namespace

void add_options(CLI::App& command, FidelityArgs& args) {
  command
      .add_option("--accuracy", args.accuracy,
                  "largest error of the simulated force, 10mN or 0.5% of 5 N: the fastest measured "
                  "setting of the plant that keeps it")
      ->check(problem_of(sim::parse_accuracy_n));
  command
      .add_option("--budget", args.budget,
                  "least speed of the plant, 1000x real time: the most accurate measured setting "
                  "that reaches it")
      ->check(problem_of(sim::parse_times_real_time));
}

FidelityRequest fidelity_request(const FidelityArgs& args) {
  return {read(args.accuracy, sim::parse_accuracy_n),
          read(args.budget, sim::parse_times_real_time)};
}

}  // namespace weft::daemon::cli
