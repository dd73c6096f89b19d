"""What a batch is asked by files: a head, a model, effects of one's own."""

import inspect
import io
import pickle
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from rows_of_calibrations import warnings

import accelcal
from accelcal.archive import block, through
from accelcal.archive.batch import BatchOptions
from accelcal.archive.block import Block, fit_block
from accelcal.archive.settings import Settings
from accelcal.archive.sources import find_sources
from accelcal.calibrate.options import Options
from accelcal.cli.main import main
from accelcal.effects.catalogue import catalogue, registered
from accelcal.errors import InputError
from accelcal.io.engines import exact_numbers
from accelcal.io.toml.effects import read_effects

PLAN = accelcal.TumblePlan(temperatures=(20.0, 60.0), strokes=4)
LENS = '[[effect]]\nid = "lens"\nname = "lens"\nphysics = "A lens."\nformula = "{}"\n'


def head(first, size=8):
    rows = "\n".join(f"{360.0 * i / size},{first if i == 0 else i}" for i in range(size))
    return f"# uncertainty: 0.5 arcsec\nangle,error [arcsec]\n{rows}\n"


def known_head(first=3):
    return accelcal.read_head(io.StringIO(head(first)))


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    """Eight tables by a unit with an effect of one's own, beside them the file of that effect."""
    folder = tmp_path_factory.mktemp("archive")
    (folder / "lens.toml").write_text(LENS.format("-r * sin(th) * abs(sin(th))"))
    (folder / "tables").mkdir()
    with registered(*read_effects(folder / "lens.toml")):
        lens = [accelcal.effect("lens").of(3e-5)]
        for seed in range(8):
            record = accelcal.simulate(plan=PLAN, effects=lens, seed=seed)
            accelcal.write_table(record, folder / "tables" / f"{seed}.csv")
        accelcal.discover(accelcal.simulate(plan=PLAN, effects=lens, seed=9)).to_json(
            folder / "model.json"
        )
    return folder


@pytest.fixture
def lens(archive):
    with registered(*read_effects(archive / "lens.toml")):
        yield accelcal.Discovery.from_json(archive / "model.json")


def assert_rows_are_those_of_fit(folder, **asked):
    found = accelcal.batch(folder, **asked)
    rows = iter(found.tables.to_dict("records"))
    for path in sorted(Path(folder).glob("*.csv")):
        calibration = accelcal.fit(accelcal.read_table(path), **asked)
        for table in calibration.tables:
            row = next(rows)
            for name, quantity in (*table.coefficients.items(), *table.error_model.items()):
                assert row[name] == pytest.approx(quantity.value, rel=1e-9, abs=1e-16)
                expanded = row[f"{name}_expanded_uncertainty"]
                assert expanded == pytest.approx(quantity.expanded_uncertainty, rel=1e-8)
            assert row["warnings"] == " | ".join(warnings(table, calibration))
    assert next(rows, None) is None
    return found


# -- rows ------------------------------------------------------------------------------------------


def one_by_one(monkeypatch):
    monkeypatch.setattr(block, "_one_by_one", lambda *_: pytest.fail("one by one"))


def test_a_known_head_is_that_of_fit(archive, monkeypatch):
    one_by_one(monkeypatch)
    found = assert_rows_are_those_of_fit(archive / "tables", head=known_head())
    plain = accelcal.batch(archive / "tables")
    assert (np.abs(found.tables["K2"] - plain.tables["K2"]) > 1e-7).all()


def test_what_told_of_the_head_counts_once(archive):
    records = [accelcal.read_table(archive / "tables" / f"{n}.csv") for n in (2, 5)]
    found = assert_rows_are_those_of_fit(archive / "tables", head=accelcal.calibrate_head(records))
    told = found.tables["warnings"].str.contains("the head was calibrated from this table too")
    assert {Path(source).stem for source in found.tables["source"][told]} == {"2", "5"}


def test_a_model_is_that_of_fit(archive, lens, monkeypatch):
    one_by_one(monkeypatch)
    found = assert_rows_are_those_of_fit(archive / "tables", model=lens, head=known_head())
    plain = accelcal.batch(archive / "tables")
    assert found.tables["residual_rms"].mean() < 0.5 * plain.tables["residual_rms"].mean()


def test_a_position_that_the_head_lacks_is_an_error_of_the_file(archive):
    four = accelcal.read_head(io.StringIO(head(1, size=4)))
    found = accelcal.batch(archive / "tables", head=four)
    told = "head position 45 deg is not among the 4 of <table>; calibrate the head at the"
    assert len(found.errors) == 8
    assert found.errors["message"].str.contains(told, regex=False).all()


def test_all_arguments_of_fit_are_taken(archive):
    asked = {"reference_temperature": 60.0, "delta0": 1e-3}
    found = assert_rows_are_those_of_fit(archive / "tables", **asked)
    assert set(found.tables["T0_degC"]) == {60.0}


# -- effects of one's own --------------------------------------------------------------------------


def test_own_effects_go_along_to_a_worker(archive, lens):
    settings = pickle.dumps(Settings(Options(model=lens)).with_own_effects())
    accelcal.unregister("lens")
    block = Block(tuple(find_sources([str(archive / "tables")])))
    assert fit_block(block, pickle.loads(settings)).told.fitted == 8
    assert "lens" not in {entry.id for entry in catalogue()}
    accelcal.register(*read_effects(archive / "lens.toml"))  # the fixture takes it out


def test_an_effect_that_nobody_knows_is_told_before_any_file(archive):
    model = accelcal.Discovery.from_json(archive / "model.json")
    with pytest.raises(InputError, match="effect 'lens' is not in the catalogue"):
        accelcal.batch(archive / "tables", model=model)


@pytest.mark.parametrize("option", ["model", "head", "specification"])
def test_a_name_in_place_of_what_it_holds_is_refused_once(archive, option):
    with pytest.raises(InputError, match="str in place of a"):
        accelcal.batch(archive / "tables", **{option: "file.json"})


def test_the_command_takes_all_three(archive, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("head.csv").write_text(head(3))
    tables = archive / "tables"
    options = ["--model", str(archive / "model.json"), "--effects", str(archive / "lens.toml")]
    options += ["--head", "head.csv"]
    for jobs in ("1", "2"):
        assert main(["batch", str(tables), "-o", f"r{jobs}.csv", "--jobs", jobs, *options]) == 0
        assert capsys.readouterr().err.startswith("8 calibrations from 8 files; gates warn in 5")
    assert Path("r1.csv").read_bytes() == Path("r2.csv").read_bytes()
    assert main(["fit", str(tables / "0.csv"), *options, "--format", "csv"]) == 0
    rows = pd.read_csv(io.StringIO(capsys.readouterr().out))
    fitted = rows[rows["coefficient"] == "k2"]["value"].tolist()
    assert pd.read_csv("r1.csv")["k2"].tolist()[:2] == pytest.approx(fitted, rel=1e-9)


@pytest.mark.parametrize(
    ("option", "name", "said"),
    [
        ("--head", "none.csv", "none.csv: no such file; give the path of a head"),
        ("--head", "tables/0.csv", "tables/0.csv:9: no column error, or correction beside it"),
        ("--model", "model.json", "model.json: effect 'lens' is not in the catalogue; it has"),
        ("--model", "lens.toml", "lens.toml"),
        ("--effects", "model.json", "model.json:1: not TOML"),
        ("--effects", "lens.toml", "error: --effects has no effect without --model; give that"),
    ],
)
def test_a_wrong_file_is_told_once(archive, tmp_path, monkeypatch, capsys, option, name, said):
    monkeypatch.chdir(archive)
    assert main(["batch", "tables", "-o", str(tmp_path / "r.csv"), option, name]) == 2
    told = capsys.readouterr().err
    assert told.startswith(said)
    assert told.count("\n") == 1
    assert not list(tmp_path.iterdir())


# -- an interrupted batch --------------------------------------------------------------------------


def test_the_journal_knows_the_content_of_the_files(lens, tmp_path):
    def asked(text, first):
        path = tmp_path / "lens.toml"
        path.write_text(LENS.format(text))
        accelcal.unregister("lens")
        accelcal.register(*read_effects(path))
        settings = Settings(Options(model=lens, head=known_head(first)))
        return settings.with_own_effects().fingerprint()

    told = {asked("sin(th)", 3), asked("sin(2*th)", 3), asked("sin(th)", 4)}
    assert len(told) == 3
    assert asked("sin(th)", 3) in told


def test_resume_with_another_head_begins_anew(archive, tmp_path, monkeypatch):
    monkeypatch.setattr(through, "LEAST_FILES", 2)
    output = tmp_path / "r.csv"

    def stop(done, _):
        if done >= 4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        accelcal.write_batch(archive / "tables", output, head=known_head(), progress=stop)
    accelcal.write_batch(archive / "tables", output, head=known_head(5), resume=True)
    expected = accelcal.batch(archive / "tables", head=known_head(5)).tables["K2"]
    written = pd.read_csv(output, **exact_numbers())
    assert written["K2"].tolist() == expected.tolist()


def test_the_options_of_a_batch_are_those_of_a_fit():
    """Type checkers and editors know them by these names, readers by the docstring."""
    handed = {n for n in inspect.signature(accelcal.fit).parameters if n != "record"}
    assert set(BatchOptions.__annotations__) == {*handed, "overrides", "specification"}
    for function in (accelcal.batch, accelcal.write_batch):
        assert all(name in inspect.getdoc(function) for name in handed)
