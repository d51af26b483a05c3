// Compares Weft with general physics engines on two scenes with a closed form: error at equal cost,
// cost at equal error. Everything is simulated. Engines are optional and separate programs, because
// their libraries contain different copies of the same symbols (Simbody has an old SUNDIALS).

#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>

#include "tests/bench/figures.hpp"
#include "tests/bench/peers/scenes.hpp"

namespace weft::bench::peers {
namespace {

void print(const char* scene, const Engine& engine, const std::vector<Run>& runs) {
  for (const Run& run : runs)
    std::printf("%-6s %-20s %-62s %8.1e  error %9.2e  %9.1f x real time%s\n", scene,
                engine.name.c_str(), run.setting.c_str(), run.step_s, run.error, 1 / run.cpu_per_s,
                run.failed     ? "  FAILED"
                : run.compared ? ""
                               : "  (not compared)");
}

// Least processor time of the runs with at most this error.
std::optional<double> cost_at(const std::vector<Run>& runs, double error) {
  std::optional<double> least;
  for (const Run& run : runs)
    if (run.compared && !run.failed && run.error <= error && (!least || run.cpu_per_s < *least))
      least = run.cpu_per_s;
  return least;
}

std::string note_on(const std::optional<double>& own, const std::optional<double>& theirs) {
  if (!own && !theirs) return "neither reaches it";
  if (!own) return "OURS DOES NOT REACH IT";
  if (!theirs) return "peer does not reach it";
  return (*theirs < *own ? "PEER IS AHEAD, " : "") + std::string("peer over ours ") +
         std::to_string(*theirs / *own);
}

// Compares the cheapest run of each peer with ours at every decade of error. True if ours is ahead
// of all.
bool compare(const char* scene, std::vector<Run> Engine::*runs, const Engine& ours,
             const std::vector<Engine>& peers, std::vector<Figure>& out) {
  bool ahead = true;
  for (double error = 0.1; error > 0.9e-6; error /= 10) {
    const auto own = cost_at(ours.*runs, error);
    for (const Engine& peer : peers) {
      if ((peer.*runs).empty()) continue;
      const auto theirs = cost_at(peer.*runs, error);
      char name[96];
      std::snprintf(name, sizeof name, "%s, error at most %.0e", scene, error);
      out.push_back({name, own.value_or(NAN) * 1e6, "us per simulated s", peer.name,
                     theirs.value_or(NAN) * 1e6, note_on(own, theirs)});
      ahead = ahead && own && (!theirs || *own <= *theirs);
    }
  }
  return ahead;
}

Run run_from(const nlohmann::json& j) {
  return {j["setting"],   j["step_s"], j["error"].is_null() ? NAN : j["error"].get<double>(),
          j["cpu_per_s"], true,        j["failed"]};
}

// Result of the program `name` beside this one; nothing if it was not built.
std::optional<Engine> run_peer(const std::filesystem::path& folder, const std::string& name) {
  const auto program = folder / ("bench_peer_" + name);
  if (!std::filesystem::exists(program)) {
    std::printf("%s: not built here (its %s is missing)\n", name.c_str(),
                name == "mujoco_wheel" ? "PyPI package mujoco" : "Debian package");
    return std::nullopt;
  }
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(program.c_str(), "r"), &pclose);
  std::string text;
  for (int c = 0; pipe && (c = std::fgetc(pipe.get())) != EOF;)
    text.push_back(static_cast<char>(c));
  const auto found = nlohmann::json::parse(text, nullptr, false);
  if (!found.is_object()) {
    std::printf("%s: ended without a result\n", name.c_str());
    return std::nullopt;
  }
  Engine out{found["name"], {}, {}};
  for (const auto& run : found["press"]) out.press.push_back(run_from(run));
  for (const auto& run : found["slide"]) out.slide.push_back(run_from(run));
  return out;
}

}  // namespace
}  // namespace weft::bench::peers

int main(int /*argc*/, char** argv) {
  using namespace weft::bench;
  using namespace weft::bench::peers;
  const Engine ours = engine({}, {});
  std::vector<Engine> peers;
  for (const char* name : {"mujoco", "mujoco_wheel", "ode", "bullet", "simbody", "cvode"})
    if (auto peer = run_peer(std::filesystem::path(argv[0]).parent_path(), name))
      peers.push_back(std::move(*peer));
  print("press", ours, ours.press);
  print("slide", ours, ours.slide);
  for (const Engine& peer : peers) {
    print("press", peer, peer.press);
    print("slide", peer, peer.slide);
  }
  std::vector<Figure> figures;
  const bool press = compare("press", &Engine::press, ours, peers, figures);
  const bool slide = compare("slide", &Engine::slide, ours, peers, figures);
  const int status = report("peers", figures);
  return press && slide ? status : 1;
}
