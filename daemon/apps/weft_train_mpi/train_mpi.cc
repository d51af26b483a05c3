// `weft-train-mpi`: `weft fabric train` with its cores shared among the ranks of an MPI job. Every
// rank reads the data set itself. Rank r of n trains cores r, r + n, r + 2n ... and sends them to
// rank 0 as lines of the model file, which represent them bit for bit. Only rank 0 writes, at the
// end.

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <iostream>
#include <optional>
#include <set>

#include "classifier/fabric/model_text.hpp"
#include "classifier/learners/learner_text.hpp"
#include "daemon/apps/weft/console.hpp"
#include "daemon/apps/weft/train_command.hpp"
#include "daemon/apps/weft_train_mpi/ranks.hpp"

namespace weft::daemon::cluster {
namespace {

using classifier::CoreTask;
using classifier::FabricCore;
using classifier::TrainOptions;
using Cores = std::vector<FabricCore>;

/// Prefix of a text that reports an error; other texts are a digest, a count or a core.
constexpr std::string_view complaint = "!";

std::string complaint_of(const Error& error) {
  return std::string(complaint) + to_string(error);
}

/// MPI's launcher ends all ranks when one dies; its own message names the dead rank.
extern "C" void on_terminate(int) {
  constexpr std::string_view text =
      "weft-train-mpi: ended by its launcher, probably because another rank failed; no model was "
      "written\n";
  const ssize_t written = ::write(STDERR_FILENO, text.data(), text.size());
  ::_exit(written < 0 ? 2 : 1);
}

Result<std::string> from_rank(std::size_t rank) {
  std::string text = Ranks::receive_from(rank);
  if (!text.starts_with(complaint)) return text;
  return fail({.code = Errc::io,
               .where = "rank " + std::to_string(rank),
               .what = text.substr(complaint.size())});
}

// ---- rank 0 ----

/// Refuses ranks that cannot read the data set, or that read another one under the same name.
Status agree(const Ranks& ranks, const std::string& sha256) {
  Ranks::give({Order::report});
  Status status;
  for (std::size_t rank = 1; rank < ranks.size(); ++rank) {
    const auto theirs = from_rank(rank);
    if (!status) continue;
    if (!theirs)
      status = pass(theirs.error());
    else if (*theirs != sha256)
      status = fail({.code = Errc::invalid_argument,
                     .where = "rank " + std::to_string(rank),
                     .what = "data set differs from that of rank 0",
                     .expected = sha256,
                     .got = *theirs,
                     .hint = "Put the data set where all machines read the same file"});
  }
  return status;
}

/// Puts the cores of one rank into their places. Receives all its messages even after an error.
Status collect(std::size_t rank, std::size_t ranks, std::size_t features,
               std::vector<std::optional<FabricCore>>& places) {
  const auto share = from_rank(rank);
  if (!share) return pass(share.error());
  Status status;
  for (std::size_t i = rank; i < places.size(); i += ranks) {
    auto core = classifier::core_from_text(Ranks::receive_from(rank), features);
    if (core)
      places[i].emplace(std::move(*core));
    else if (status)
      status = pass(core.error(), "rank " + std::to_string(rank));
  }
  return status;
}

Result<Cores> train_shared(const Ranks& ranks, const classifier::FeatureMatrix& matrix,
                           std::size_t pairs, const TrainOptions& options, const CoreTask& task) {
  Ranks::give({Order::train, classifier::task_text(task)});
  auto own = classifier::train_task(matrix, task, options, 0, ranks.size());
  Status status;
  if (!own) status = pass(own.error(), "rank 0");
  std::vector<std::optional<FabricCore>> places(pairs);
  for (std::size_t k = 0; own && k < own->size(); ++k)
    places[k * ranks.size()].emplace(std::move((*own)[k]));
  for (std::size_t rank = 1; rank < ranks.size(); ++rank) {
    Status theirs = collect(rank, ranks.size(), matrix.names.size(), places);
    if (status) status = std::move(theirs);
  }
  if (!status) return pass(status.error());
  Cores cores;
  for (auto& place : places) cores.push_back(std::move(*place));
  return cores;
}

// Learners without cores (LDA, SVC, trees) are trained on rank 0 alone: seconds, whatever the
// number of classes.
Result<classifier::ChosenLearner> train_on_all(const Ranks& ranks, const cli::ChosenTrials& chosen,
                                               classifier::Learner learner,
                                               const TrainOptions& options) {
  if (auto ok = agree(ranks, chosen.sha256); !ok) return pass(ok.error());
  const auto& labels = chosen.features.labels;
  const std::size_t classes = std::set<std::string>(labels.begin(), labels.end()).size();
  const cli::LearningTask work = cli::learning_task(chosen, learner, options.cap);
  // A task names no columns, so a choice between features of imprints is trained here alone
  // (seconds).
  if (&work.matrix != &chosen.features)
    return classifier::train_best(work.matrix, work.candidates, options);
  return classifier::train_best(work.matrix, work.candidates, options, [&](const CoreTask& task) {
    return train_shared(ranks, chosen.features, classifier::pair_count(classes), options, task);
  });
}

int lead(const Ranks& ranks, const cli::TrainArgs& args, cli::Console& console) {
  const cli::Trainer trainer = [&](const cli::ChosenTrials& chosen, classifier::Learner learner,
                                   const TrainOptions& options) {
    return train_on_all(ranks, chosen, learner, options);
  };
  const Result<int> status = cli::run_train_with(trainer, args, console);
  Ranks::give({Order::end});
  return status ? *status : cli::report(console, status.error());
}

// ---- every other rank ----

void train_share(const Ranks& ranks, const cli::ChosenTrials& chosen, const TrainOptions& options,
                 std::string_view text) {
  const auto task = classifier::task_from_text(text);
  if (!task) return Ranks::send_to_root(complaint_of(task.error()));
  const auto cores =
      classifier::train_task(chosen.features, *task, options, ranks.rank(), ranks.size());
  if (!cores) return Ranks::send_to_root(complaint_of(cores.error()));
  Ranks::send_to_root(std::to_string(cores->size()));
  for (const FabricCore& core : *cores) Ranks::send_to_root(classifier::core_text(core));
}

int follow(const Ranks& ranks, const cli::TrainArgs& args) {
  const auto chosen = cli::load_trials(args.dataset, args.trials, true);
  for (Ranks::Command next = Ranks::take(); next.order != Order::end; next = Ranks::take()) {
    if (next.order == Order::train)
      train_share(ranks, *chosen, cli::train_options(args.training), next.text);
    else
      Ranks::send_to_root(chosen ? chosen->sha256 : complaint_of(chosen.error()));
  }
  return cli::exit_ok;
}

int run(int argc, char** argv) {
  const Ranks ranks;
  if (ranks.root()) std::signal(SIGTERM, on_terminate);
  cli::Console console{std::cout, std::cerr, false, false, nullptr};
  CLI::App command("Runs weft fabric train on the ranks of an MPI job.", "weft-train-mpi");
  cli::TrainArgs args;
  cli::add_options(command, args);
  command.add_flag("--json", console.json, "print one JSON object on standard output");
  try {
    command.parse(argc, argv);
    return ranks.root() ? lead(ranks, args, console) : follow(ranks, args);
  } catch (const CLI::ParseError& e) {  // the same on every rank
    if (!ranks.root()) return e.get_exit_code() == 0 ? cli::exit_ok : cli::exit_usage;
    if (e.get_exit_code() == 0) return command.exit(e);
    return cli::report_usage(console, e.what());
  } catch (const std::exception& e) {  // std::bad_alloc and other exceptions of libraries
    cli::report_thrown(console, e, "rank " + std::to_string(ranks.rank()));
    MPI_Abort(MPI_COMM_WORLD, cli::exit_failure);
    return cli::exit_failure;
  }
}

}  // namespace
}  // namespace weft::daemon::cluster

int main(int argc, char** argv) {
  return weft::daemon::cluster::run(argc, argv);
}
