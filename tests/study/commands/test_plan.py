"""A plan shows what there is to compute, and what is left out."""

from tests.conftest import SMALL


def test_a_plan_shows_effects_tasks_and_memory(main, campaign):
    campaign.write_text(SMALL + "[effects]\ncoupling = false\n[outputs]\nrecords = false\ntractions_at = [5]\n")
    code, said, _ = main("plan", campaign)
    assert code == 0
    rows = {
        cells[0]: cells
        for line in said.splitlines()
        if (cells := [cell.strip() for cell in line.split("   ") if cell.strip()])
    }
    assert rows["coupling"][1:] == ["off", rows["coupling"][2]]
    assert rows["coupling"][2].startswith("shear and pressure do not act on each other")
    assert rows["pin_translation"][1:] == ["on"]
    assert rows["outputs.records"][2] == "friction records are not kept once their drives are done"
    assert rows["tasks"][-1] == "MB of arrays each, about"
    assert [rows[kind][1] for kind in ("compliance", "friction", "states", "drive")] == ["1", "8", "4", "8"]
