def run_tree(parameters, progress): raise NotImplementedError
