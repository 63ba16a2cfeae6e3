extends SceneTree
# Plays the first animation of a scene that Godot imported, and prints where every bone is at each second asked for:
# godot3-server --path PROJECT -s play.gd FILE SECONDS...

func find(node, kind):
	if node.is_class(kind):
		return node
	for child in node.get_children():
		var found = find(child, kind)
		if found:
			return found
	return null

func _init():
	var words = OS.get_cmdline_args()
	var at = Array(words).find("play.gd") + 1
	var scene = load("res://" + words[at]).instance()
	get_root().add_child(scene)
	var skeleton = find(scene, "Skeleton")
	var player = find(scene, "AnimationPlayer")
	var clip = player.get_animation_list()[player.get_animation_list().size() - 1]
	player.play(clip)
	var shown = []
	for i in range(at + 1, words.size()):
		player.seek(float(words[i]), true)
		var places = {}
		for bone in range(skeleton.get_bone_count()):
			var place = skeleton.global_transform.xform(skeleton.get_bone_global_pose(bone).origin)
			places[skeleton.get_bone_name(bone)] = [place.x, place.y, place.z]
		shown.append(places)
	print("SHOWN " + to_json({"clip": clip, "length": player.get_animation(clip).length, "bones": shown}))
	quit()
