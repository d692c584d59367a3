"""Runs both methods on scenes with known stones and prints how well each does, as a table of Markdown."""
import argparse
import json
import subprocess
from pathlib import Path

METHODS = {'published': ['--config', 'rheinwalt2025'], 'default': []}
# No stone of these scenes is wider, metres.
WIDEST = '0.3'


def scores(program, scene, out, more):
    """What `gravelometer validate` says of a run on the scene."""
    smallest = json.loads((scene / 'meta.json').read_text())['area_threshold']
    limits = ['--max-grain', WIDEST, '--min-grain-area', str(smallest)]
    run = [program, 'run', scene / 'mesh.ply', '-o', out, '--force', '--labelled-mesh', *limits, *more]
    for command in (run, [program, 'validate', out, scene]):
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode:
            raise SystemExit(f'{" ".join(map(str, command))}\n{done.stderr}')
    return json.loads((out / 'validation.json').read_text())


def row(name, found):
    of = found['default']
    f1 = [' / '.join(f"{s[rule]['f1']:.3f}" for rule in ('detection_majority', 'detection_iou50')) for s in found.values()]
    area = [f"{s['area']['iou']['mean']:.3f}" for s in found.values()]
    d50 = [f"{round(s['b_axis_mm']['error_percent']['D50']):+d}" for s in [*found.values(), of['perfect_labels']]]
    return f"| {name} ({of['visible']}) | " + ' | '.join(f1 + area + d50) + ' |'


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('program', type=Path, help='gravelometer')
    parser.add_argument('scenes', type=Path, nargs='+', help='folders with mesh.ply, truth.csv, truth.npz and meta.json')
    asked = parser.parse_args()
    print('| scene (visible stones) | F1 by majority / half in common: published | default | area IoU: published | default '
          '| D50 of b, % off: published | default | true labels |')
    print('|---|---|---|---:|---:|---:|---:|---:|')
    for scene in asked.scenes:
        found = {method: scores(asked.program, scene, scene / method, more) for method, more in METHODS.items()}
        print(row(scene.name, found), flush=True)


if __name__ == '__main__':
    main()
