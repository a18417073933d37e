!> What a scene needs of the machine, told before it runs. The figures are those of the arrays that grow with the scene,
!> at the moment when most of them are there; measured, a large scene takes 0.7 to 1.2 times as much.
module scene_needs
   use auto_solver, only: lanczos_is_faster
   use blas_threads, only: blas_buffer
   use failures, only: fail, failure_t, status_bad_input
   use frequency_study, only: default_count, meshes_and_solvers
   use kinds, only: wp
   use machine_memory, only: free_addresses, free_memory, in_bytes
   use measure_list, only: measure_count
   use number_text, only: to_text
   use scene_types, only: law_restitution, method_exact, scene_t, solver_auto, solver_dsygv, solver_lanczos
   use sweep_settings, only: parameter_duration, parameter_elements, swept_t
   use sweep_study, only: cases_of, threads_for
   implicit none (type, external)
   private
   public :: check_needs, need_t, needs_of

   real(wp), parameter :: bytes_of_number = 8.0_wp
   !> Libraries and small things.
   real(wp), parameter :: overhead = 1.6e7_wp
   !> LAPACK numbers the work space of the modes, 2 (2 n)^2 + 12 n, in 31 bits.
   integer, parameter :: most_dense = 16383
   !> So many samples can be numbered, and looked at.
   real(wp), parameter :: most_samples = 1.0e8_wp
   !> Distance of the samples in the runs of &statements, tau.
   real(wp), parameter :: statements_step = 0.01_wp

   type :: need_t
      !> Bytes in all
      real(wp) :: bytes = overhead
      !> The greatest of its parts, what it is for, and what would make it less
      real(wp) :: greatest = 0.0_wp
      character(:), allocatable :: purpose
      character(:), allocatable :: advice
      !> Why there is no number of bytes that would do
      character(:), allocatable :: refusal
   end type need_t

contains

   !> Refuse a scene for which there is no room.
   subroutine check_needs(scene, threads, error)
      !> The scene
      type(scene_t), intent(in) :: scene
      !> Threads of a sweep; 0: as many as there are cores
      integer, intent(in) :: threads
      !> Set when it does not fit
      type(failure_t), allocatable, intent(inout) :: error

      type(need_t) :: need
      real(wp) :: memory, addresses

      call needs_of(scene, threads, need)
      if (allocated(need%refusal)) then
         call fail(error, status_bad_input, need%refusal//': '//need%advice)
         return
      end if
      if (.not. allocated(need%purpose)) return
      memory = free_memory()
      ! linear algebra has not begun yet
      addresses = free_addresses() - real(blas_buffer(), wp)
      if (need%bytes > memory) then
         call fail(error, status_bad_input, 'needs '//in_bytes(need%bytes)//' of memory, most of it for '//need%purpose// &
                   ', and '//in_bytes(memory)//' are free: '//need%advice)
      else if (need%bytes > addresses) then
         call fail(error, status_bad_input, 'needs '//in_bytes(need%bytes)//' of memory, most of it for '//need%purpose// &
                   ', and the limit (ulimit -v) leaves '//in_bytes(max(addresses, 0.0_wp))//': '//need%advice)
      end if
   end subroutine check_needs

   !> What a scene needs.
   subroutine needs_of(scene, threads, need)
      !> The scene
      type(scene_t), intent(in) :: scene
      !> Threads of a sweep; 0: as many as there are cores
      integer, intent(in) :: threads
      !> Its need
      type(need_t), intent(out) :: need

      integer :: workers

      if (scene%wants_sweep) then
         workers = threads_for(threads, cases_of(scene%sweep))
         call add_sweep(scene, workers, need)
      else if (scene%wants_statements) then
         call add_statements(scene, need)
      else if (scene%wants_precision) then
         call add_precision(scene, need)
      else
         if (scene%wants_frequencies) call add_frequencies(scene, need)
         if (scene%wants_response) call add_response(scene, need)
      end if
   end subroutine needs_of

   !> One part of a need.
   pure subroutine add(need, bytes, purpose, advice)
      !> The need
      type(need_t), intent(inout) :: need
      !> The part's bytes, what they are for, and what would make them less
      real(wp), intent(in) :: bytes
      character(*), intent(in) :: purpose
      character(*), intent(in) :: advice

      need%bytes = need%bytes + bytes
      if (bytes <= need%greatest .or. allocated(need%refusal)) return
      need%greatest = bytes
      need%purpose = purpose
      need%advice = advice
   end subroutine add

   !> Refuse it whatever the memory.
   pure subroutine refuse(need, refusal, advice)
      !> The need
      type(need_t), intent(inout) :: need
      !> Why, and what to change
      character(*), intent(in) :: refusal
      character(*), intent(in) :: advice

      if (allocated(need%refusal)) return
      need%refusal = refusal
      need%advice = advice
   end subroutine refuse

   !> All modes of a mesh by singular values: the flexibility, its copy, vectors and their work space.
   subroutine add_modes(elements, solves, advice, need)
      !> Elements
      integer, intent(in) :: elements
      !> So many at a time
      integer, intent(in) :: solves
      !> What would make it less
      character(*), intent(in) :: advice
      !> The need
      type(need_t), intent(inout) :: need

      if (elements > most_dense) then
         call refuse(need, 'the modes of '//to_text(elements)//' elements cannot be found at once, only those of up to ' &
                     //to_text(most_dense), advice)
      else
         call add(need, 6.0_wp*bytes_of_number*(2.0_wp*real(elements, wp))**2*real(solves, wp), &
                  'all modes of '//to_text(elements)//' elements', advice)
      end if
   end subroutine add_modes

   !> A table of frequencies: the greatest of its columns.
   subroutine add_frequencies(scene, need)
      !> The scene
      type(scene_t), intent(in) :: scene
      !> The need
      type(need_t), intent(inout) :: need

      type(need_t) :: column, greatest
      integer, allocatable :: elements(:), solvers(:)
      real(wp), allocatable :: ratios(:)
      integer :: i, j, modes

      call meshes_and_solvers(scene, elements, ratios, solvers)
      modes = scene%frequencies%count
      if (modes == 0) modes = default_count
      do i = 1, size(elements)
         do j = 1, size(solvers)
            column = need_t()
            call add_column(solvers(j), elements(i), modes, .false., column)
            if (i == 1 .and. scene%output%mode_shapes > 0) &
               call add_column(solvers(1), elements(1), scene%output%mode_shapes, .true., column)
            if (allocated(column%refusal)) then
               need = column
               return
            end if
            if (column%bytes > greatest%bytes) greatest = column
         end do
      end do
      if (allocated(greatest%purpose)) call add(need, greatest%bytes - overhead, greatest%purpose, greatest%advice)
   end subroutine add_frequencies

   !> Some modes of one mesh by one solver.
   subroutine add_column(solver, elements, most_modes, with_shapes, need)
      !> One of the `solver_` constants
      integer, intent(in) :: solver
      !> Elements
      integer, intent(in) :: elements
      !> Modes asked for
      integer, intent(in) :: most_modes
      !> Their shapes too
      logical, intent(in) :: with_shapes
      !> The need
      type(need_t), intent(inout) :: need

      character(*), parameter :: lesser = 'give &frequencies fewer elements, or solver = ''lanczos'' and a small count'
      real(wp) :: n
      integer :: modes
      logical :: by_lanczos

      n = real(elements, wp)
      modes = min(most_modes, 2*elements)
      by_lanczos = solver == solver_lanczos
      if (solver == solver_auto) by_lanczos = lanczos_is_faster(elements, modes)
      if (by_lanczos) then
         modes = min(modes, elements)
         ! vectors, deflections at four points an element, shapes; the beam itself
         call add(need, bytes_of_number*(n*(8.0_wp*real(modes, wp) + 30.0_wp) + 12.5_wp*real(modes, wp)**2), &
                  to_text(modes)//' modes of '//to_text(elements)//' elements', 'give a smaller count or fewer elements')
      else if (solver == solver_dsygv) then
         call add(need, 3.0_wp*bytes_of_number*(2.0_wp*n)**2, 'the full matrices of '//to_text(elements)//' elements', lesser)
      else if (with_shapes) then
         call add_modes(elements, 1, lesser, need)
      else
         call add(need, 4.0_wp*bytes_of_number*(2.0_wp*n)**2, 'the flexibility of '//to_text(elements)//' elements', lesser)
      end if
      if (with_shapes) call add(need, 6.0_wp*bytes_of_number*n*real(modes, wp), to_text(modes)//' mode shapes', &
                                'give &output fewer mode_shapes')
   end subroutine add_column

   !> A response, or as many as there are cases: its beam, and its records three times: as they are, in the file that is
   !> made in memory, and in the bytes that are written.
   subroutine add_response(scene, need)
      !> The scene
      type(scene_t), intent(in) :: scene
      !> The need
      type(need_t), intent(inout) :: need

      real(wp), parameter :: copies = 3.0_wp
      real(wp) :: samples, shapes, runs
      integer :: histories

      runs = 1.0_wp
      if (scene%wants_cases) runs = real(max(size(scene%cases%values), 1), wp)
      call add_beam(scene, scene%mesh%elements, 1, need)
      associate (output => scene%output)
         histories = count([output%displacement_stop, output%displacement_tip, output%velocity_stop, output%contact_force])
         ! the ledger has an axis of its own
         if (output%energy) histories = histories + 8
         if (histories > 0) histories = histories + 1
         samples = scene%response%duration/scene%response%step
         if (samples > most_samples) then
            call refuse(need, '&response has '//so_many(samples)//' samples, more than '//so_many(most_samples), &
                        'give it a shorter duration or a longer step')
            return
         end if
         call add(need, copies*runs*bytes_of_number*samples*real(histories, wp), 'the histories of ' &
                  //so_many(runs*samples)//' samples', &
                  'give &response a longer step, or &output fewer histories')
         shapes = 0.0_wp
         if (allocated(output%shape_times)) shapes = real(size(output%shape_times), wp)
         if (output%shape_step > 0.0_wp) shapes = shapes + scene%response%duration/output%shape_step
         call add(need, copies*runs*bytes_of_number*shapes*4.0_wp*(real(scene%mesh%elements, wp) + 2.0_wp), &
                  'the whole beam at '//so_many(shapes)//' instants', 'give &output a longer shape_step')
      end associate
   end subroutine add_response

   !> A beam, and its modes where motion is found in them.
   subroutine add_beam(scene, elements, runs, need)
      !> The scene
      type(scene_t), intent(in) :: scene
      !> Elements
      integer, intent(in) :: elements
      !> So many at a time
      integer, intent(in) :: runs
      !> The need
      type(need_t), intent(inout) :: need

      character(*), parameter :: fewer = 'give &mesh fewer elements'

      if (scene%response%method == method_exact) then
         call add_modes(elements, runs, fewer//', or &response method = ''newmark''', need)
      else
         call add(need, real(runs, wp)*800.0_wp*real(elements, wp), to_text(elements)//' elements', fewer)
      end if
   end subroutine add_beam

   !> A sweep: the values of its parameters, and for each thread a beam and the rows of a part.
   subroutine add_sweep(scene, workers, need)
      !> The scene
      type(scene_t), intent(in) :: scene
      !> Threads
      integer, intent(in) :: workers
      !> The need
      type(need_t), intent(inout) :: need

      real(wp), parameter :: largest_part = 16384.0_wp
      real(wp) :: values, rows, duration
      integer :: k, axes, elements

      axes = 0
      values = 0.0_wp
      do k = 1, size(scene%sweep%swept)
         associate (swept => scene%sweep%swept(k))
            if (.not. (allocated(swept%list) .or. allocated(swept%range) .or. allocated(swept%log_range))) cycle
            axes = axes + 1
            if (allocated(swept%list)) then
               values = values + real(size(swept%list), wp)
            else
               values = values + real(max(swept%points, scene%sweep%count), wp)
            end if
         end associate
      end do
      ! the random order of one of them besides
      call add(need, bytes_of_number*values*(1.0_wp + 0.5_wp/real(max(axes, 1), wp)), 'the parameters of ' &
               //so_many(cases_of(scene%sweep))//' cases', 'give &sweep fewer cases, or design = ''grid''')
      elements = nint(greatest_of(scene%sweep%swept(parameter_elements), real(scene%mesh%elements, wp)))
      call add_beam(scene, elements, workers, need)
      if (scene%response%method /= method_exact) then
         duration = greatest_of(scene%sweep%swept(parameter_duration), scene%response%duration)
         call add(need, bytes_of_number*real(5*workers, wp)*duration/scene%response%step, 'the samples of a case', &
                  'give &response a longer step')
      end if
      rows = real(min(max(scene%sweep%part_cases, 0), huge(1)), wp)
      rows = bytes_of_number*min(max(rows, largest_part), cases_of(scene%sweep))*real(measure_count + axes, wp)
      call add(need, rows*real(workers + 3, wp), 'the rows of parts', 'give &sweep fewer part_cases')
   end subroutine add_sweep

   !> The statements: one run after the other, with its ledger.
   subroutine add_statements(scene, need)
      !> The scene
      type(scene_t), intent(in) :: scene
      !> The need
      type(need_t), intent(inout) :: need

      character(*), parameter :: shorter = 'give &statements a shorter duration'

      associate (samples => scene%statements%duration/statements_step)
         if (samples > most_samples) then
            call refuse(need, '&statements has '//so_many(samples)//' samples in each run, more than ' &
                        //so_many(most_samples), shorter)
            return
         end if
         call add(need, 55.0_wp*bytes_of_number*samples, 'runs of '//so_many(samples)//' samples', shorter)
      end associate
      ! the example is run on a mesh of twice as many
      call add_modes(2*scene%statements%fine_elements, 1, 'give &statements fewer fine_elements', need)
   end subroutine add_statements

   !> Run time against error: one run after the other, beside a reference.
   subroutine add_precision(scene, need)
      !> The scene
      type(scene_t), intent(in) :: scene
      !> The need
      type(need_t), intent(inout) :: need

      real(wp) :: samples, step
      integer :: elements

      elements = scene%mesh%elements
      associate (precision => scene%precision)
         step = scene%response%step
         if (allocated(precision%steps)) then
            if (size(precision%steps) > 0) step = minval(precision%steps)
         end if
         samples = precision%duration/step
         if (allocated(precision%mesh_elements)) elements = max(elements, maxval(precision%mesh_elements))
      end associate
      if (samples > most_samples) then
         call refuse(need, '&precision has '//so_many(samples)//' samples in a run, more than '//so_many(most_samples), &
                     'give it a shorter duration or longer steps')
         return
      end if
      call add(need, 34.0_wp*bytes_of_number*samples, 'runs of '//so_many(samples)//' samples', &
               'give &precision a shorter duration or longer steps')
      call add_modes(elements, 1, 'give fewer elements', need)
   end subroutine add_precision

   !> The greatest value of a swept parameter.
   pure function greatest_of(swept, otherwise) result(value)
      !> The parameter
      type(swept_t), intent(in) :: swept
      !> Its value where it is not swept
      real(wp), intent(in) :: otherwise
      real(wp) :: value

      value = otherwise
      if (allocated(swept%list)) value = maxval(swept%list)
      if (allocated(swept%range)) value = swept%range(2)
      if (allocated(swept%log_range)) value = swept%log_range(2)
   end function greatest_of

   !> A large number, rounded where it is not to be counted.
   pure function so_many(number) result(words)
      !> The number
      real(wp), intent(in) :: number
      character(:), allocatable :: words

      real(wp), parameter :: countable = 1.0e6_wp
      character(16) :: digits

      if (number < countable) then
         words = to_text(nint(number))
      else
         write (digits, '(es8.1)') number
         words = trim(adjustl(digits))
      end if
   end function so_many

end module scene_needs
