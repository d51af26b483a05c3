#include <catch2/catch.hpp>
#include <limits>

#include "daemon/base/text/csv_table.hpp"
#include "daemon/storage/dataset/import.hpp"
#include "tests/unit/daemon/storage/support.hpp"

namespace features_csv_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::test;

TEST_CASE("a feature table has its names in order and gives every double back") {
  classifier::FeatureMatrix features;
  features.names = {"mean.P", "max.M.1"};
  features.files = {"a.csv", "b, \"c\".csv"};
  features.labels = {"Silk", "Wool"};
  features.groups = {"0", ""};
  features.values = classifier::Matrix(2, 2);
  features.values(0, 0) = 0.1;
  features.values(0, 1) = -std::numeric_limits<double>::denorm_min();
  features.values(1, 0) = classifier::largest_feature;
  features.values(1, 1) = 3;
  const TemporaryFolder folder;
  REQUIRE(export_features_csv(folder / "f.csv", features));
  CHECK(read_file(folder / "f.csv")
            .starts_with("file,label,group,mean.P,max.M.1\na.csv,Silk,0,0.10000000000000001,"));

  auto csv = CsvTable::open(folder / "f.csv");
  REQUIRE(csv);
  for (std::size_t i = 0; i < 2; ++i) {
    REQUIRE(csv->next());
    CHECK(csv->fields()[0] == features.files[i]);
    CHECK(csv->number(4) == features.values(i, 1));
  }
  CHECK(csv->number(3) == features.values(1, 0));
  CHECK(csv->next() == false);
}

TEST_CASE("a feature table that cannot be written whole is not written") {
  const TemporaryFolder folder;
  classifier::FeatureMatrix features;
  features.names = {"mean.P"};
  features.files = {"a"};
  features.labels = {"Silk"};
  features.groups = {""};
  features.values = classifier::Matrix(1, 1, std::numeric_limits<double>::quiet_NaN());
  CHECK_FALSE(export_features_csv(folder / "f.csv", features));
  CHECK(files_in(folder.path()) == 0);
  features.values = classifier::Matrix(1, 1, std::numeric_limits<double>::max());
  const Status too_large = export_features_csv(folder / "f.csv", features);
  REQUIRE_FALSE(too_large);
  CHECK(to_string(too_large.error()).find("mean.P") != std::string::npos);
  features.values = classifier::Matrix(1, 1, 1.0);
  CHECK(export_features_csv("/proc/f.csv", features).error().code == Errc::io);
}

TEST_CASE("a sweep's factors stand beside the features of their trials and of their windows") {
  Dataset dataset;
  dataset.info.factors = {"force_n", "speed_mps"};
  dataset.trials.resize(2);
  dataset.records.resize(2);
  dataset.trials[0].file = "a";
  dataset.trials[1].file = "b";
  dataset.records[0].spec.factors = {2, 0.001};
  dataset.records[1].spec.factors = {5, 0.004};
  classifier::FeatureMatrix features;
  features.names = {"mean.P"};
  features.files = {"b#w0", "a"};
  features.labels = {"Silk", "Silk"};
  features.groups = {"1", "2"};
  features.values = classifier::Matrix(2, 1, 7.0);
  const TemporaryFolder folder;
  REQUIRE(export_features_csv(folder / "f.csv", features, factor_columns(dataset, features)));
  CHECK(read_file(folder / "f.csv") ==
        "file,label,group,force_n,speed_mps,mean.P\nb#w0,Silk,1,5,0.0040000000000000001,7\n"
        "a,Silk,2,2,0.001,7\n");
  features.files[0] = "a+b";  // from two trials: no single setting
  CHECK(factor_columns(dataset, features).names.empty());
}

}  // namespace features_csv_test
