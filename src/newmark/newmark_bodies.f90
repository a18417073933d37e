!> Bodies in Newmark's steps. A body adds a degree of freedom of its own after those of the beam, coupled to them by
!> contacts alone. If the degrees of freedom are modes, the body is a mode, and its coordinate is a point after those of
!> the beam in a state vector (module `modal_steps`).
module newmark_bodies
   use beam_model, only: beam_model_t
   use body_modes, only: damping_rate_of, squared_frequency_of
   use kinds, only: lambda1_power4, wp
   use run_settings, only: body_settings_t
   use skyline_matrix, only: skyline_t
   implicit none (type, external)
   private
   public :: add_bodies, damp_bodies

contains

   !> Append the degrees of freedom of bodies to the matrices of the beam.
   pure subroutine add_bodies(bodies, model)
      type(body_settings_t), intent(in) :: bodies(:)
      !> The beam, with its rigid supports fixed
      type(beam_model_t), intent(inout) :: model

      call append(lambda1_power4*bodies%mass_ratio*squared_frequency_of(bodies), model%stiffness)
      call append(bodies%mass_ratio, model%mass)
   end subroutine add_bodies

   !> Append a diagonal to a matrix.
   pure subroutine append(diagonal, matrix)
      real(wp), intent(in) :: diagonal(:)
      type(skyline_t), intent(inout) :: matrix

      integer :: i

      associate (order => matrix%order, entries => size(matrix%values))
         matrix%first_row = [matrix%first_row, [(order + i, i=1, size(diagonal))]]
         matrix%diagonal = [matrix%diagonal, [(entries + i, i=1, size(diagonal))]]
      end associate
      matrix%values = [matrix%values, diagonal]
      matrix%order = matrix%order + size(diagonal)
   end subroutine append

   !> Give bodies the damping of their own dampers, whatever the damping of the beam.
   pure subroutine damp_bodies(bodies, zeta, mass, damping)
      type(body_settings_t), intent(in) :: bodies(:)
      !> The step adds 2 zeta K to the damping of all degrees of freedom
      real(wp), intent(in) :: zeta
      !> Mass matrix, bodies last
      type(skyline_t), intent(in) :: mass
      !> Damping besides 2 zeta K, with the profile of the mass matrix; unallocated: there is none yet
      type(skyline_t), allocatable, intent(inout) :: damping

      if (.not. allocated(damping)) then
         allocate (damping, source=mass)
         damping%values = 0.0_wp
      end if
      associate (place => mass%diagonal(mass%order - size(bodies) + 1:))
         damping%values(place) = bodies%mass_ratio*(damping_rate_of(bodies) - 2.0_wp*zeta*squared_frequency_of(bodies))
      end associate
   end subroutine damp_bodies

end module newmark_bodies
