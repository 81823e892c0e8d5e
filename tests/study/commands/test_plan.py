"""A plan shows what there is to compute, and what is left out."""

import xarray as xr

from tests.conftest import SMALL


def test_a_plan_shows_effects_tasks_and_memory(main, campaign):
    campaign.write_text(SMALL + "[effects]\ncoupling = false\n[outputs]\nrecords = false\ntractions_at = [5]\n")
    code, said, _ = main("plan", campaign)
    assert code == 0
    rows = {
        cells[0]: cells
        for line in said.splitlines()
        if (cells := [cell.strip() for cell in line.split("  ") if cell.strip()])
    }
    assert rows["coupling"][1:] == ["off", rows["coupling"][2]]
    assert rows["coupling"][2].startswith("shear and pressure do not act on each other")
    assert rows["pin_translation"][1:] == ["on"]
    assert rows["outputs.records"][2] == "friction records are not kept once their drives are done"
    assert rows["tasks"][-1] == "MB of arrays each, about"
    assert [rows[kind][1] for kind in ("compliance", "record", "states", "drive")] == ["1", "8", "4", "8"]


def test_drives_that_no_stage_computes_are_named_and_left_out(main, campaign):
    out = campaign.parent / "out"
    campaign.write_text(SMALL.replace(', "dynamics"]', "]"))
    code, said, _ = main("plan", campaign)
    assert code == 0
    assert 'drives left out, as stages leave out "dynamics": slow, fast' in said
    assert main("run", campaign, "--out", out, "--serial")[0] == 0
    with xr.open_dataset(out / "results.nc") as found:
        assert "drive_outcome" not in found
        assert "spring_stiffness" not in found.coords
    assert "4 bit-identical" in main("verify", out / "results.nc")[1]
    campaign.write_text(SMALL)
    assert "left out, as" not in main("plan", campaign)[1]
