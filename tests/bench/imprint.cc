// Features of one 32 x 32 imprint at three scales, compared with common Python: the reference's
// loops, numpy with scipy, and numpy with OpenCV. All forms must give the same features.

#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>

#include "classifier/features/feature_matrix.hpp"
#include "classifier/imprint/scale_features.hpp"
#include "daemon/analysis/imprint/imprint_scene.hpp"
#include "daemon/storage/imprints/imprint_dataset.hpp"
#include "tests/bench/figures.hpp"

namespace {

using namespace weft;
using classifier::imprint::Image;
using classifier::imprint::ScaleFeatures;

constexpr const char* sigmas = "1,2,4";

double seconds_now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// Output of imprint_peers.py; discarded without numpy.
nlohmann::json run_peers(const std::filesystem::path& image) {
  const std::string command = "/usr/bin/python3 tests/bench/imprint_peers.py " + image.string() +
                              " " + sigmas + " ../shared/oracle/static002.py";
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), &pclose);
  std::string out;
  for (int c = 0; pipe && (c = std::fgetc(pipe.get())) != EOF;) out.push_back(static_cast<char>(c));
  return nlohmann::json::parse(out, nullptr, false);
}

void write_image(const Image& image, const std::filesystem::path& path) {
  std::ofstream out(path);
  for (std::size_t r = 0; r < image.rows(); ++r)
    for (std::size_t c = 0; c < image.cols(); ++c)
      out << image(r, c) << (c + 1 < image.cols() ? ',' : '\n');
}

double median_seconds(ScaleFeatures& features, const Image& image) {
  constexpr int rounds = 201, each = 20;
  std::vector<double> seconds;
  for (int round = 0; round < rounds; ++round) {
    const double began = seconds_now();
    for (int i = 0; i < each; ++i)
      if (!features.extract(image)) return std::nan("");
    seconds.push_back((seconds_now() - began) / each);
  }
  return bench::median(seconds);
}

// Largest relative difference; spreads of orientation are compared by their squares, as in
// imprint_oracle.py.
double largest_difference(std::span<const double> ours, const std::vector<double>& theirs) {
  double worst = 0.0;
  for (std::size_t i = 0; i < ours.size(); ++i) {
    const bool orientation = i % 10 == 3;
    const double a = orientation ? ours[i] * ours[i] : ours[i];
    const double b = orientation ? theirs[i] * theirs[i] : theirs[i];
    worst = std::max(worst, std::abs(a - b) / std::max({std::abs(a), std::abs(b), 1e-9}));
  }
  return worst;
}

}  // namespace

int main() {
  const auto dataset = daemon::simulate_imprints({.level = sim::Level::z});
  const auto imprints = daemon::extract_imprints(*dataset);
  const Image& image = (*imprints)[9].image;  // a rasp, pressed heavily: it has edges and extrema
  auto features = ScaleFeatures::make({.sigmas = {1, 2, 4}});
  const auto values = features->extract(image);
  const double ours = median_seconds(*features, image);
  const auto path = std::filesystem::temp_directory_path() / "weft_bench_imprint.csv";
  write_image(image, path);
  const nlohmann::json peers = run_peers(path);
  std::filesystem::remove(path);
  std::vector<bench::Figure> figures;
  if (peers.is_object())
    for (const auto& [name, peer] : peers.items()) {
      auto seconds = peer.at("seconds").get<std::vector<double>>();
      const double worst =
          largest_difference(*values, peer.at("features").get<std::vector<double>>());
      char note[120];
      std::snprintf(note, sizeof note, "SIMULATED %s; features differ by at most %.1e (relative)",
                    (*imprints)[9].file.c_str(), worst);
      figures.push_back({"32 x 32 imprint, 3 scales, 30 features", ours * 1e6, "us",
                         "Python: " + name, bench::median(seconds) * 1e6, note,
                         bench::faster_by(20)});
    }
  auto paper = ScaleFeatures::make({.sigmas = {1}});
  figures.push_back({"the same, sigma 1 alone", median_seconds(*paper, image) * 1e6, "us",
                     "all three scales", ours * 1e6, ""});
  return bench::report("imprint", figures);
}
