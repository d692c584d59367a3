//! A run that ends in whatever way is completed by `--resume` with the same bytes, or it is said why not.
//!
//! Kills at commit points and panics on request need a build with debug assertions, which `cargo test` makes.
#![allow(missing_docs, clippy::unwrap_used, unreachable_pub)]

mod support;

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use support::bed::{Rng, bed, write_ply};
#[cfg(debug_assertions)]
use support::interrupted::{RESULTS, copy};
use support::interrupted::{Scene, WORK, files, results, run_json, said, send};
use support::small_disk::SmallDisk;

/// Visits of a commit point at which a run is killed: the first, the second, one in the middle, the last; and the
/// number of all visits.
#[cfg(debug_assertions)]
fn visits(name: &str, tiles: u64) -> (Vec<u64>, u64) {
    let all = match name {
        // Side and spacing, curvature of tiles; side, findings of tiles.
        "ledger.before_write" | "ledger.after_write" => 2 * tiles + 3,
        "ledger.after_sync" => 2,
        // Two ledgers, one of them begun again with its column, and the manifest of the index.
        name if name.starts_with("atomic_file.") => 4,
        "curvature.before_record" => tiles,
        "results.between_names" => 6,
        _ => 1,
    };
    let mut some = vec![1, 2, all.div_ceil(2), all];
    some.retain(|&visit| visit <= all);
    some.sort_unstable();
    some.dedup();
    (some, all)
}

#[cfg(debug_assertions)]
#[test]
fn a_run_killed_at_every_commit_point_is_completed_with_the_same_bytes() {
    let scene = Scene::new();
    for name in gravelometer::store::FAIL_POINTS {
        let (some, all) = visits(name, scene.tiles);
        for visit in some {
            let at = format!("{name}:{visit}");
            let out = scene.killed(&at, &at, &[]);
            scene.resumes(&out, &[], &at);
            std::fs::remove_dir_all(out).unwrap();
        }
        let (out, beyond) = (scene.path("beyond"), format!("{name}:{}", all + 1));
        let said = said(scene.run(&out, &["--force"]).env(gravelometer::store::KILL_AT, &beyond));
        assert_eq!(said.code, Some(0), "{name} is visited more than {all} times: {}", said.err);
    }
}

#[cfg(unix)]
#[test]
fn a_run_killed_at_any_time_once_or_twice_is_completed_with_the_same_bytes() {
    let scene = Scene::new();
    let (mut rng, mut killed) = (Rng(7), 0);
    for case in 0..20 {
        let out = scene.path(&format!("out-{case}"));
        for attempt in 0..1 + case % 2 {
            let resume: &[&str] = if attempt == 0 { &[] } else { &["--resume", "--force"] };
            let mut child = scene.run(&out, resume).stderr(Stdio::null()).spawn().unwrap();
            std::thread::sleep(scene.lasts.mul_f64(rng.within(0.0, 1.0)));
            let _ = child.kill();
            killed += u32::from(!child.wait().unwrap().success());
        }
        // A run that was done before it could be killed has nothing to resume.
        scene.resumes(&out, &["--force"], &format!("killed at random, case {case}"));
    }
    assert!(killed >= 15, "only {killed} runs were killed in time");
}

#[cfg(debug_assertions)]
#[test]
fn whatever_is_damaged_in_the_work_folder_the_resumed_run_gives_the_same_bytes() {
    let scene = Scene::new();
    let half = 2 + scene.tiles + 1 + scene.tiles / 2;
    let interrupted = scene.killed("interrupted", &format!("ledger.after_write:{half}"), &[]);
    let mut rng = Rng(11);
    let all = files(&interrupted);
    assert!(all.len() >= 13, "{:?}", all.keys());
    for (case, (path, bytes)) in all.into_iter().enumerate() {
        let name = path.strip_prefix(&interrupted).unwrap();
        // Every file is changed within; besides, they are by turns removed, cut off or longer.
        let mut flipped = bytes.clone();
        if !bytes.is_empty() {
            flipped[rng.below(bytes.len())] ^= 1 << rng.below(8);
        }
        let other = match case % 3 {
            _ if name.ends_with("gravelometer-work.lock") => Some(b"text".to_vec()),
            0 => None,
            1 => Some(bytes[..rng.below(bytes.len())].to_vec()),
            _ => Some([&bytes[..], b"more"].concat()),
        };
        let cut = name.ends_with("tiles") || name.ends_with("grains");
        let cut = cut.then(|| Some(bytes[..rng.below(bytes.len())].to_vec()));
        for (k, damaged) in [Some(flipped), other].into_iter().chain(cut).enumerate() {
            let out = scene.path(&format!("damaged-{case}-{k}"));
            copy(&interrupted, &out);
            match damaged {
                Some(bytes) => std::fs::write(out.join(name), bytes).unwrap(),
                None => std::fs::remove_file(out.join(name)).unwrap(),
            }
            let otherwise: &[&str] = match (case + k) % 3 {
                0 => &["--threads=1", "--memory=300MiB"],
                1 => &["--threads=3", "--tile-size=0.7"],
                _ => &["--memory=90MiB"],
            };
            scene.resumes(&out, otherwise, &format!("{} damaged in way {k}", name.display()));
        }
    }
}

#[cfg(debug_assertions)]
#[test]
fn a_changed_setting_or_input_is_refused_by_name_and_nothing_is_touched() {
    let scene = Scene::new();
    let out = scene.killed("out", &format!("ledger.after_write:{}", scene.tiles + 8), &[]);
    let before = files(&out);
    let refused = |mesh: &Path, more: &[&str], says: &[&str]| {
        said(scene.of(mesh, &out, more).arg("--resume")).fails(2, says);
        assert!(files(&out) == before, "{says:?}: something was touched");
    };
    let mesh = &scene.mesh;
    let concave = ["--set", "segment.concave_below=-0.07"];
    refused(mesh, &concave, &["segment.concave_below was -0.05 and is -0.07\nhelp"]);
    refused(mesh, &["--set", "curvature.neighbours=20"], &["curvature.neighbours was 25 and is 20\nhelp"]);
    refused(mesh, &["--max-grain=0.5"], &["segment.max_grain_m was 0.6 and is 0.5\nhelp"]);
    refused(mesh, &["--set=output.labelled_mesh=false"], &["output.labelled_mesh was true and is false\nhelp"]);
    let other = scene.path("other.ply");
    write_ply(&other, &bed(22, 70, 60));
    refused(&other, &[], &["input 1 was {", "} and is {"]);
    let touched = scene.path("touched.ply");
    let mut bytes = std::fs::read(mesh).unwrap();
    let last = bytes.len() - 1000;
    bytes[last] ^= 1;
    std::fs::write(&touched, &bytes).unwrap();
    let time = std::time::SystemTime::UNIX_EPOCH + Duration::from_secs(1_000_000_007);
    std::fs::File::options().append(true).open(&touched).unwrap().set_modified(time).unwrap();
    refused(&touched, &[], &["input 1 was {", "\"modified_s\":1000000007"]);

    // Without --resume the changed run begins anew and gives what it gives elsewhere.
    let (elsewhere, here) = (scene.path("elsewhere"), &out);
    scene.finishes(&elsewhere, &concave);
    scene.finishes(here, &concave);
    assert!(results(here) == results(&elsewhere) && results(here) != scene.whole);
}

#[cfg(debug_assertions)]
#[test]
fn a_run_along_valleys_that_is_killed_is_completed_with_the_same_bytes() {
    let scene = Scene::new();
    let valleys = ["--set", "segment.method=valleys"];
    scene.finishes(&scene.path("along-valleys"), &valleys);
    let whole = results(&scene.path("along-valleys"));
    assert!(whole != scene.whole);
    for (i, at) in ["ledger.after_write:1", "ledger.after_write:4", "ledger.after_sync:1"].into_iter().enumerate() {
        let out = scene.killed(&format!("killed-{i}"), at, &valleys);
        assert!(results(&out).is_empty(), "{at}");
        let said = said(scene.run(&out, &valleys).arg("--resume"));
        assert_eq!(said.code, Some(0), "{at}: {}", said.err);
        assert!(results(&out) == whole, "{at}: other results");
    }
    // The other method is another run.
    let out = scene.killed("other", "ledger.after_write:4", &valleys);
    said(scene.run(&out, &[]).arg("--resume")).fails(2, &["segment.method"]);
}

#[test]
fn a_named_work_folder_is_used_again_by_a_run_with_another_threshold() {
    let scene = Scene::new();
    let (work, first, second) = (scene.path("work"), scene.path("first"), scene.path("second"));
    let in_work = ["--work-dir", work.to_str().unwrap()];
    scene.finishes(&first, &in_work);
    scene.is_whole(&first, "a named work folder");
    let concave = ["--set", "segment.concave_below=-0.07"];
    scene.finishes(&second, &[&in_work[..], &concave].concat());
    for stage in run_json(&second)["stages"].as_array().unwrap() {
        let idle = !["index", "spacing", "curvature"].contains(&stage["name"].as_str().unwrap());
        assert!(idle || stage["amount"] == 0, "done again: {stage}");
    }
    let elsewhere = scene.path("elsewhere");
    scene.finishes(&elsewhere, &concave);
    assert!(results(&second) == results(&elsewhere) && results(&second) != scene.whole);
    // Another survey takes the folder over, and the first can have it back.
    let other = scene.path("other.ply");
    write_ply(&other, &bed(23, 60, 60));
    assert_eq!(said(&mut scene.of(&other, &scene.path("third"), &in_work)).code, Some(0));
    let fourth = scene.path("fourth");
    scene.finishes(&fourth, &in_work);
    scene.is_whole(&fourth, "a work folder that another survey had");
}

#[cfg(debug_assertions)]
#[test]
fn a_full_disk_is_named_and_the_run_goes_on_when_there_is_room() {
    let scene = Scene::new();
    let Some(disk) = SmallDisk::new(8 << 10) else {
        println!("skipped: this user cannot mount a small disk");
        return;
    };
    let fill = disk.path().join("fill");
    let full_but = |kibibytes: u64| {
        let mut file = std::fs::File::options().append(true).create(true).open(&fill).unwrap();
        while std::io::Write::write_all(&mut file, &[1; 1 << 12]).is_ok() {}
        file.set_len(file.metadata().unwrap().len() - (kibibytes << 10)).unwrap();
    };
    // The work folder: in the curvature pass, and in the grain pass.
    for at in [3, scene.tiles + 6] {
        let (work, out) = (disk.path().join(format!("work-{at}")), scene.path(&format!("out-{at}")));
        let in_work = ["--work-dir", work.to_str().unwrap()];
        let killed =
            said(scene.run(&out, &in_work).env(gravelometer::store::KILL_AT, format!("ledger.after_write:{at}")));
        assert_eq!(killed.code, None, "{}", killed.err);
        full_but(0);
        let says = [work.to_str().unwrap(), "the disk is full", "free some space", "--resume"];
        said(scene.run(&out, &in_work).arg("--resume")).fails(1, &says);
        assert!(results(&out).is_empty());
        // Moved to another disk it goes on as well.
        let moved = scene.path(&format!("moved-{at}"));
        copy(&work, &moved);
        scene.resumes(&out, &["--work-dir", moved.to_str().unwrap()], "a moved work folder");
        std::fs::remove_file(&fill).unwrap();
        scene.resumes(&out, &["--force", in_work[0], in_work[1]], "room was made");
    }
    // The folder of the results, with the work elsewhere.
    let (out, work) = (disk.path().join("out"), scene.path("work"));
    let in_work = ["--work-dir", work.to_str().unwrap()];
    let killed = said(scene.run(&out, &in_work).env(gravelometer::store::KILL_AT, "ledger.after_sync:2"));
    assert_eq!(killed.code, None, "{}", killed.err);
    let mut refused = 0;
    for kibibytes in [16, 100, 300, 500, 700, 900] {
        full_but(kibibytes);
        let said = said(scene.run(&out, &in_work).args(["--resume", "--force"]));
        if said.code != Some(0) {
            said.fails(1, &[out.to_str().unwrap(), "--resume"]);
            assert!(results(&out).is_empty(), "{kibibytes} KiB: half a result");
            refused += 1;
        }
    }
    assert!(refused > 2, "only {refused} runs met a full disk");
    std::fs::remove_file(&fill).unwrap();
    scene.resumes(&out, &["--force", in_work[0], in_work[1]], "room was made for the results");
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_ends_soon_says_how_to_go_on_and_goes_on() {
    let scene = Scene::new();
    let (mut rng, mut interrupted) = (Rng(3), 0);
    for case in 0..12 {
        let out = scene.path(&format!("out-{case}"));
        let child = scene.under_way(&out, &[]);
        std::thread::sleep(scene.lasts.mul_f64(rng.within(0.0, 0.9)));
        let began = Instant::now();
        send(["-INT", "-TERM"][case % 2], &child);
        let ended = child.wait_with_output().unwrap();
        let took = began.elapsed();
        let err = String::from_utf8(ended.stderr).unwrap();
        assert!(took < Duration::from_millis(2500), "{took:?}: {err}");
        if ended.status.code() == Some(0) {
            scene.is_whole(&out, "a signal that came too late");
            continue;
        }
        assert_eq!(ended.status.code(), Some(130), "{err}");
        assert!(err.contains("interrupted") && err.contains("--resume"), "{err}");
        assert!(results(&out).is_empty(), "interrupted, but there are results");
        interrupted += 1;
        scene.resumes(&out, &[], "an interruption");
    }
    assert!(interrupted >= 6, "only {interrupted} runs were interrupted in time");
}

#[cfg(unix)]
#[test]
fn a_second_run_in_the_same_folders_is_refused_while_the_first_lasts() {
    let scene = Scene::new();
    let (out, work) = (scene.path("out"), scene.path("work"));
    let in_work = ["--work-dir", work.to_str().unwrap()];
    let first = scene.under_way(&out, &in_work);
    // Stopped, it lasts as long as it takes to look.
    send("-STOP", &first);
    let same_out = said(&mut scene.run(&out, &["--force"]));
    let same_work = said(&mut scene.run(&scene.path("second"), &in_work));
    send("-CONT", &first);
    same_out.fails(1, &["out: another run is writing its results here"]);
    same_work.fails(1, &["work is used by another run"]);
    assert!(first.wait_with_output().unwrap().status.success());
    scene.is_whole(&out, "a run that others tried to join");
}

#[test]
fn a_folder_of_somebody_else_is_never_used_for_work() {
    let scene = Scene::new();
    let out = scene.path("out");
    let own = out.join(WORK).join("index/notes.txt");
    std::fs::create_dir_all(own.parent().unwrap()).unwrap();
    std::fs::write(&own, "mine").unwrap();
    for more in [&[][..], &["--force"], &["--resume"]] {
        said(&mut scene.run(&out, more))
            .fails(1, &["gravelometer-work: holds other files, such as \"index\"", "--work-dir"]);
        assert_eq!(std::fs::read(&own).unwrap(), b"mine");
        assert_eq!(files(&out).len(), 1);
    }
    let work = |path: &Path| ["--work-dir".to_owned(), path.to_str().unwrap().to_owned()];
    let run = |out: &Path, path: &Path, more: &[&str]| said(scene.run(out, more).args(work(path)));
    run(&scene.path("a"), &scene.mesh, &[]).fails(1, &["bed.ply: is not a folder", "--work-dir"]);
    run(&scene.path("b"), &scene.path("b"), &[]).fails(1, &["is the folder of the results", "--work-dir"]);
    run(&scene.path("b"), scene.folder.path(), &[]).fails(1, &["holds other files", "--work-dir"]);
    run(&scene.path("b"), &scene.mesh.join("deep"), &[]).fails(1, &["cannot make the folder", "deep"]);
    assert!(!scene.path("a").exists() && !scene.path("b").exists(), "a refused run left its folder");
    // Within OUT it has a name of its own, and stays.
    let (out, inside) = (scene.path("c"), scene.path("c/kept"));
    assert_eq!(run(&out, &inside, &[]).code, Some(0));
    assert!(inside.join("index/manifest").exists());
    scene.is_whole(&out, "a work folder in OUT");
    assert_eq!(run(&out, &inside, &["--force"]).code, Some(0));
    scene.is_whole(&out, "a work folder in OUT again");
}

#[cfg(unix)]
#[test]
fn a_work_folder_that_cannot_be_written_is_named() {
    let scene = Scene::new();
    let Some(disk) = SmallDisk::new(1024) else {
        println!("skipped: this user cannot mount a small disk");
        return;
    };
    let path = disk.path().to_str().unwrap();
    assert!(Command::new("mount").args(["-o", "remount,ro", path]).status().unwrap().success());
    let said = said(&mut scene.run(&scene.path("out"), &["--work-dir", path]));
    said.fails(1, &[path, "cannot make the lock file", "Read-only"]);
}

#[test]
fn results_that_are_there_are_not_replaced_where_there_is_nothing_to_resume() {
    let scene = Scene::new();
    let out = scene.path("whole");
    let was = files(&out);
    // The same run, however its work is cut.
    for more in [&["--resume"][..], &["--resume", "--threads=1", "--tile-size=0.7"]] {
        let again = said(&mut scene.run(&out, more));
        assert!(again.code == Some(0) && again.err.contains("nothing is left to do"), "{:?} {}", again.code, again.err);
        assert!(files(&out) == was, "{more:?} changed something");
    }
    let changes = ["--max-grain=0.5", "--set=raster.cell_m=0.3", "--offset=1,2,3"];
    for (change, name) in changes.iter().zip(["segment.max_grain_m", "raster.cell_m", "input.offset"]) {
        said(&mut scene.run(&out, &["--resume", change])).fails(2, &["is done, and was another one", name, "--force"]);
    }
    said(&mut scene.run(&out, &[])).fails(1, &["holds files already", "--force"]);
    // Where a result is gone the run is not done.
    std::fs::rename(out.join("grains.gpkg"), scene.path("grains.gpkg")).unwrap();
    said(&mut scene.run(&out, &["--resume"])).fails(1, &["holds files already", "--force"]);
    std::fs::rename(scene.path("grains.gpkg"), out.join("grains.gpkg")).unwrap();
    // Without a report nobody knows what the other results are.
    std::fs::rename(out.join("run.json"), scene.path("run.json")).unwrap();
    said(&mut scene.run(&out, &["--resume"])).fails(1, &["holds files already", "--force"]);
    std::fs::rename(scene.path("run.json"), out.join("run.json")).unwrap();
    assert!(files(&out) == was, "a refused run changed something");
}

#[cfg(debug_assertions)]
#[test]
fn a_tile_that_panics_loses_only_itself_and_is_tried_again() {
    let scene = Scene::new();
    let out = scene.path("out");
    let panicking = said(scene.run(&out, &[]).env(gravelometer::store::PANIC_AT, "grains:7"));
    assert_eq!(panicking.code, Some(3), "{}", panicking.err);
    assert!(panicking.err.contains("tile 7 is lost") && panicking.err.contains("--resume"), "{}", panicking.err);
    let lost = run_json(&out)["facts"]["lost_tiles"].clone();
    assert_eq!((lost.as_array().unwrap().len(), lost[0]["tile"].as_u64()), (1, Some(7)));
    assert!(out.join(WORK).exists() && results(&out).len() == RESULTS.len());
    // Lost again, then found.
    let again = said(scene.run(&out, &["--resume"]).env(gravelometer::store::PANIC_AT, "grains:7"));
    assert_eq!(again.code, Some(3), "{}", again.err);
    scene.resumes(&out, &[], "a lost tile");
    assert_eq!(run_json(&out)["facts"]["lost_tiles"].as_array().unwrap().len(), 0);
}
