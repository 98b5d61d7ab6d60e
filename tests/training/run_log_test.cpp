#include "trainer/run_log.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>

#include "engine/core/files.h"

namespace darb {
namespace {

TEST(CfgArgs, names_what_the_photos_were_loaded_with) {
    Dataset dataset;
    dataset.root = "/photos";
    dataset.views.resize(2);
    dataset.views[1].is_test = true;
    dataset.options = {.images_folder = "images_4", .resolution = 2};
    TrainOptions options;
    options.sh_degree = 2;
    EXPECT_EQ(cfg_args(dataset, options, "/out"),
              "Namespace(sh_degree=2, source_path='/photos', model_path='/out', "
              "images='images_4', resolution=2, white_background=False, data_device='cpu', "
              "eval=True)");
}

TEST(RunLog, names_that_are_no_utf_8_and_numbers_that_are_not_finite_are_written_and_read) {
    const auto folder = std::filesystem::path(testing::TempDir()) / fmt::format("log_{}", getpid());
    Evaluation evaluation;
    evaluation.iteration = 7;
    evaluation.views = {{"f\xfcr.jpg", std::nan(""), std::nan("")}};
    evaluation.psnr_db = std::nan("");
    evaluation.ssim = 0.5;
    RunLog(folder, false).evaluation(evaluation);
    RunLog(folder, true).cut_after(7);
    ReportData data;
    add_events({nlohmann::json::parse(read_text_file(folder / "run.jsonl"))}, data);
    std::filesystem::remove_all(folder);
    ASSERT_EQ(data.evaluations.size(), 1u);
    EXPECT_TRUE(std::isnan(data.evaluations[0].psnr_db));
    EXPECT_EQ(data.evaluations[0].ssim, 0.5);
    add_events({{{"event", "iteration"}, {"iteration", 50}, {"loss", nullptr}}}, data);
    EXPECT_TRUE(std::isnan(data.samples.at(0).loss));
}

}  // namespace
}  // namespace darb
